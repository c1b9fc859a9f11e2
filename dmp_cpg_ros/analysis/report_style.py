# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Looks of the report: one style sheet, light and dark, on screen and on paper."""

from __future__ import annotations

CSS = """
:root { color-scheme: light dark;
  --ink: #1c2127; --soft: #5b6570; --line: #dfe3e8; --page: #f6f7f9; --card: #ffffff;
  --good: #11713a; --bad: #b3261e; --accent: #0a5ea8; --zebra: #f7f9fb;
  --mono: ui-monospace, "SF Mono", Menlo, Consolas, "DejaVu Sans Mono", monospace; }
@media (prefers-color-scheme: dark) { :root {
  --ink: #e6e9ed; --soft: #9aa5b1; --line: #333b45; --page: #14181d; --card: #1c2229;
  --good: #5fd08a; --bad: #ff8a80; --accent: #6db3f2; --zebra: #212830; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 15px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
main { max-width: 1000px; margin: 0 auto; padding: 32px 20px 64px; }
h1 { font-size: 1.7em; line-height: 1.25; margin: 0 0 4px; letter-spacing: -0.01em; }
h2 { font-size: 1.2em; margin: 44px 0 12px; padding-top: 14px; border-top: 1px solid var(--line); }
h3 { font-size: 1.02em; margin: 0 0 10px; }
.subtitle { color: var(--soft); margin: 0 0 20px; }
nav { display: flex; flex-wrap: wrap; gap: 4px 18px; margin: 0 0 20px; font-size: 0.93em; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }
.scroll { overflow-x: auto; margin: 0 0 16px; background: var(--card);
  border: 1px solid var(--line); border-radius: 8px; }
table { border-collapse: collapse; width: 100%; font-size: 0.93em; }
th, td { text-align: left; padding: 7px 12px; vertical-align: top;
  border-bottom: 1px solid var(--line); }
tr:last-child > td { border-bottom: 0; }
thead th { color: var(--soft); font-weight: 600; vertical-align: bottom; }
tbody tr:nth-child(even) { background: var(--zebra); }
th.number, td.number { text-align: right; }
td.number { font-variant-numeric: tabular-nums; white-space: nowrap; }
td.mark { white-space: nowrap; font-weight: 600; }
td.good { color: var(--good); }
td.bad { color: var(--bad); }
td.none { color: var(--soft); font-weight: 400; }
code { font: 0.92em var(--mono); overflow-wrap: anywhere; }
pre { margin: 0; padding: 14px; overflow: auto; max-height: 480px; font: 12.5px/1.5 var(--mono); }
figure { margin: 0 0 22px; padding: 16px; background: var(--card);
  border: 1px solid var(--line); border-radius: 8px; }
figure img { display: block; width: 100%; height: auto; border-radius: 4px; background: #ffffff; }
figcaption { margin-top: 10px; color: var(--soft); font-size: 0.93em; }
figcaption b { color: var(--ink); }
.pictures { display: grid; gap: 14px; margin: 20px 0 0;
  grid-template-columns: repeat(auto-fit, minmax(260px, 1fr)); }
.pictures figure { margin: 0; padding: 10px; }
summary { cursor: pointer; color: var(--accent); margin: 0 0 8px; }
footer { margin-top: 48px; color: var(--soft); font-size: 0.88em; }
@media print {
  body { background: #ffffff; }
  figure, .scroll { break-inside: avoid; }
  nav { display: none; }
}
"""
