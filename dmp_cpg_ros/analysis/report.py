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
from dmp_cpg_ros.analysis.strict_json import plain, to_json

STEADY_NOTE = (
    '<p>Means over whole gait cycles of each stretch of constant reference, after settling; '
    'speeds in m/s, turn rates in rad/s, errors relative to the reference.</p>'
)


@dataclass(frozen=True)
class ReportContents:
    """What goes into a report.

    Attributes
    ----------
    title, subtitle : str
        Heads of the page.
    metrics, manifest : mapping
        As in ``metrics.json`` and ``manifest.json``.
    figures : mapping of str to Path
        PNG files by the names of the catalogue.
    pictures : mapping of str to (Path, str)
        PNG files and captions.
    lock_step : bool or None
        Whether the run kept no wall time; None when not known.
    """

    title: str
    subtitle: str
    metrics: Mapping[str, Any]
    manifest: Mapping[str, Any]
    figures: Mapping[str, Path]
    pictures: Mapping[str, tuple[Path, str]] = field(default_factory=dict)
    lock_step: bool | None = None


def render(contents: ReportContents) -> str:
    """Return the report as HTML text; pictures are inside it."""
    metrics = plain(contents.metrics)
    sections = [
        ('summary', 'Summary', _summary(contents, metrics)),
        ('figures', 'Figures', _figures(contents)), ('stops', 'Stops and starts', _stops(metrics)),
        ('speeds', 'Steady speeds', _speeds(metrics)), ('metrics', 'Metrics', _metrics(metrics)),
        ('certificate', 'Certificate', _certificate(metrics)),
        ('manifest', 'Manifest', _manifest(contents))]
    sections = [section for section in sections if section[2]]
    links = ''.join(f'<a href="#{name}">{title}</a>' for name, title, _ in sections)
    body = ''.join(
        f'<section id="{name}"><h2>{title}</h2>{content}</section>\n' for name, title,
        content in sections)
    title, created = escape(contents.title), escape(str(contents.manifest.get('created', '')))
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<title>{title}</title><style>{CSS}</style></head>\n<body><main>'
        f'<header><h1>{title}</h1><p class="subtitle">{escape(contents.subtitle)}</p></header>'
        f'<nav>{links}</nav>\n{body}<footer>dmp_cpg_ros · {created}</footer>'
        '</main></body></html>\n'
    )


def write_report(path: Path, contents: ReportContents) -> None:
    """Write the report as UTF-8."""
    path.write_text(render(contents), encoding='utf-8')


def _summary(contents: ReportContents, metrics: dict[str, Any]) -> str:
    table = parts.fact_table(facts(metrics, contents.lock_step))
    pictures = ''.join(parts.figure(path, title) for path, title in contents.pictures.values())
    return table + (f'<div class="pictures">{pictures}</div>' if pictures else '')


def _figures(contents: ReportContents) -> str:
    return ''.join(
        parts.figure(contents.figures[entry.name], entry.title, entry.caption)
        for entry in CATALOGUE
        if entry.name in contents.figures
    )


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
        if metrics[group]['all']
    )


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


def _manifest(contents: ReportContents) -> str:
    listed = {key: value for key, value in contents.manifest.items() if key != 'parameters'}
    rows = [
        [f'<code>{escape(name)}</code>', parts.text(value)]
        for name, value in parts.flattened(plain(listed)).items()
    ]
    parameters = escape(to_json(contents.manifest.get('parameters', {})))
    return (
        parts.table(['Name', 'Value'], rows) + '<details><summary>Parameters</summary>'
        f'<div class="scroll"><pre>{parameters}</pre></div></details>'
    )
