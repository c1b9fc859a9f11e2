# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``report.html``: one file that opens from disk and fetches nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis import report_parts as parts
from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.analysis.figures.catalogue import CATALOGUE
from dmp_cpg_ros.analysis.metrics.definitions import DEFINITIONS
from dmp_cpg_ros.analysis.report_style import CSS
from dmp_cpg_ros.analysis.strict_json import to_json

STEADY_NOTE = (
    '<p>Means over whole gait cycles of each stretch of constant reference, after settling; '
    'speeds in m/s, turn rates in rad/s, errors relative to the reference.</p>'
)


@dataclass(frozen=True)
class RunResults:
    """What an analysis found and wrote.

    Attributes
    ----------
    folder : Path
        Where everything is.
    metrics, manifest : dict
        As in ``metrics.json`` and ``manifest.json``.
    report : Path or None
        None when no report was asked for.
    figures : dict of str to Path
        PNG files by the names of the catalogue.
    pictures : dict of str to (Path, str)
        PNG files and captions by name.
    """

    folder: Path
    metrics: dict[str, Any]
    manifest: dict[str, Any]
    report: Path | None
    figures: dict[str, Path] = field(default_factory=dict)
    pictures: dict[str, tuple[Path, str]] = field(default_factory=dict)


def render(title: str, subtitle: str, results: RunResults) -> str:
    """Return the report as HTML text; pictures are inside it."""
    metrics = results.metrics
    sections = [
        ('summary', 'Summary', _summary(results)),
        ('figures', 'Figures', _figures(results)), ('stops', 'Stops and starts', _stops(metrics)),
        ('speeds', 'Steady speeds', _speeds(metrics)), ('metrics', 'Metrics', _metrics(metrics)),
        ('certificate', 'Certificate', _certificate(metrics)),
        ('manifest', 'Manifest', _manifest(results.manifest))]
    sections = [section for section in sections if section[2]]
    links = ''.join(f'<a href="#{name}">{title}</a>' for name, title, _ in sections)
    body = ''.join(
        f'<section id="{name}"><h2>{title}</h2>{content}</section>\n' for name, title,
        content in sections)
    title, created = escape(title), escape(str(results.manifest.get('created', '')))
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<title>{title}</title><style>{CSS}</style></head>\n<body><main>'
        f'<header><h1>{title}</h1><p class="subtitle">{escape(subtitle)}</p></header>'
        f'<nav>{links}</nav>\n{body}<footer>dmp_cpg_ros · {created}</footer>'
        '</main></body></html>\n')


def _summary(results: RunResults) -> str:
    table = parts.fact_table(facts(results.metrics, results.manifest.get('lock_step')))
    pictures = ''.join(parts.figure(path, title) for path, title in results.pictures.values())
    return table + (f'<div class="pictures">{pictures}</div>' if pictures else '')


def _figures(results: RunResults) -> str:
    return ''.join(parts.figure(results.figures[entry.name], entry.title, entry.caption)
                   for entry in CATALOGUE if entry.name in results.figures)


def _metrics(metrics: dict[str, Any]) -> str:
    numbers = {group: values for group, values in metrics.items() if group != 'certificate'}
    rows = []
    for name, value in parts.flattened(numbers).items():
        unit, meaning = DEFINITIONS.get(name, ('', ''))
        rows.append(
            [f'<code>{escape(name)}</code>', parts.text(value), escape(unit), escape(meaning)]
        )
    return parts.table(['Name', 'Value', 'Unit', 'Meaning'], rows, numbers=(1,))


def _stops(metrics: dict[str, Any]) -> str:
    return ''.join(
        f'<h3>{title}</h3>{parts.record_table(metrics[group]["all"])}'
        for group, title in (('stop', 'Stops'), ('start', 'Starts'))
        if metrics[group]['all'])


def _speeds(metrics: dict[str, Any]) -> str:
    steady = metrics['tracking']['steady']
    return STEADY_NOTE + parts.record_table(steady) if steady else ''


def _certificate(metrics: dict[str, Any]) -> str:
    entries = metrics['certificate']
    if not entries:
        return ''
    if all(isinstance(entry, dict) for entry in entries):
        return parts.record_table(entries)
    return parts.table(['Inequality'], [[parts.text(entry)] for entry in entries])


def _manifest(manifest: Mapping[str, Any]) -> str:
    listed = {key: value for key, value in manifest.items() if key != 'parameters'}
    rows = [[f'<code>{escape(name)}</code>', parts.text(value)]
            for name, value in parts.flattened(listed).items()]
    parameters = escape(to_json(manifest.get('parameters', {})))
    return (
        parts.table(['Name', 'Value'], rows) + '<details><summary>Parameters</summary>'
        f'<div class="scroll"><pre>{parameters}</pre></div></details>')
