# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``report.html``, one file that opens from disk and fetches nothing: the figures in their order,
and the run in plain sentences, each with its number and whether it holds.
"""

from __future__ import annotations

import base64
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from inspect import getdoc
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.analysis.figures import gait, robot, style
from dmp_cpg_ros.analysis.metrics.definitions import DEFINITIONS
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.analysis.strict_json import to_json
from dmp_cpg_ros.analysis.tables import as_text, flattened
from dmp_cpg_ros.files import writable

_log = logging.getLogger(__name__)

CATALOGUE = (
    gait.target_kinematics, gait.canonical_states, gait.phase_portrait, gait.footfall,
    robot.path, robot.speed_tracking, robot.attitude, robot.estimation, robot.torques,
    robot.timing)
"""The figures, in their order."""


def caption(draw: Callable[..., object]) -> tuple[str, str]:
    """Title of a figure, and what there is to see: its function's docstring."""
    title, _, text = (getdoc(draw) or draw.__name__).partition('.\n\n')
    return title, ' '.join(text.split())


def write_figures(recording: Recording, context: RunContext, folder: Path) -> dict[str, Path]:
    """Draw and write ``NAME.png`` for each figure that the recording allows; one that its values
    do not let be drawn is warned of and left out.

    Returns
    -------
    dict of str to Path
        The files by the figures' names, in order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for draw in CATALOGUE:
        file = writable(folder / f'{draw.__name__}.png')
        try:
            with style.applied():
                figure = draw(recording, context)
                if figure is not None:
                    FigureCanvasAgg(figure).print_png(file)
                    written[draw.__name__] = file
        except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
            _log.warning("no figure '%s': %s", draw.__name__, error)
    return written


STEADY_NOTE = (
    '<p>Means over whole gait cycles of each stretch of constant reference, after settling; '
    'speeds in m/s, turn rates in rad/s, errors relative to the reference.</p>')

MARKS = {True: ('good', '✓ holds'), False: ('bad', '✗ does not hold'), None: ('none', '–')}
"""Marks of facts are words too, not only colours."""

UNITS = {'_m_s': 'm/s', '_s': 's', '_m': 'm', '_n': 'N'}
"""Endings of keys that name a unit."""

CSS, SCRIPT = (Path(__file__).with_suffix(kind).read_text(encoding='utf-8')
               for kind in ('.css', '.js'))

ZOOM = 'drag or click to enlarge; a double click shows all'
"""What can be done with a figure."""

FOLDED = ('Steady speeds', 'Metrics', 'Injected failures', 'Certificate', 'Manifest')
"""Sections that are opened by a click."""


def render(title: str, subtitle: str, metrics: Mapping[str, Any], manifest: Mapping[str, Any],
           figures: Mapping[str, Path], pictures: Mapping[str, tuple[Path, str]],
           story: str = '') -> str:
    """Return the report as HTML text; pictures are inside it.

    Parameters
    ----------
    title, subtitle : str
        Above everything.
    metrics, manifest : mapping
        As in ``metrics.json`` and ``manifest.json``.
    figures : mapping of str to Path
        PNG files by the names of the catalogue.
    pictures : mapping of str to (Path, str)
        PNG files and captions by name.
    story : str
        Figure at the top, as HTML.
    """
    shown = ''.join(_figure(path, caption) for path, caption in pictures.values())
    listed = manifest.get('failures')
    failures = [of for of in listed if isinstance(of, Mapping)] if isinstance(listed, list) else []
    sections = {
        'Summary': _summary(metrics, manifest) + (
            f'<div class="pictures">{shown}</div>' if shown else ''),
        'Figures': ''.join(_figure(figures[draw.__name__], *caption(draw))
                           for draw in CATALOGUE if draw.__name__ in figures),
        'Stops and starts': ''.join(
            f'<h3>{name}s</h3>{_records(entries)}' for name in ('Stop', 'Start')
            if (entries := metrics[name.lower()]['all'])),
        'Steady speeds': _records(metrics['tracking']['steady'], STEADY_NOTE),
        'Metrics': _metrics(metrics),
        'Injected failures': _records(failures),
        'Certificate': _records([entry if isinstance(entry, Mapping) else {'inequality': entry}
                                 for entry in metrics['certificate'] or ()]),
        'Manifest': _manifest(manifest)}
    ids = {name: name.lower().replace(' ', '_') for name, content in sections.items() if content}
    links = ''.join(f'<a href="#{of}">{name}</a>' for name, of in ids.items())
    body = ''.join(
        f'<details id="{of}"{"" if name in FOLDED else " open"}><summary><h2>{name}</h2></summary>'
        f'{sections[name]}</details>\n' for name, of in ids.items())
    title, created = escape(title), escape(str(manifest.get('created', '')))
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<title>{title}</title><style>{CSS}</style></head>\n<body><main>'
        f'<header><h1>{title}</h1><p class="subtitle">{escape(subtitle)}</p></header>'
        f'<nav>{links}</nav>\n{story}\n{body}<footer>dmp_cpg_ros · {created}</footer></main>'
        f'<script>{SCRIPT}</script></body></html>\n')


def _summary(metrics: Mapping[str, Any], manifest: Mapping[str, Any]) -> str:
    rows = []
    for fact in facts(metrics, manifest.get('lock_step')):
        kind, word = MARKS[fact.holds]
        rows.append([escape(fact.statement), escape(fact.finding),
                     f'<span class="mark {kind}">{word}</span>'])
    return _table(('Statement', 'Found', ''), rows)


def _metrics(metrics: Mapping[str, Any]) -> str:
    numbers = flattened({name: of for name, of in metrics.items() if name != 'certificate'})
    return _table(('Name', 'Value', 'Unit', 'Meaning'), (
        [f'<code>{escape(name)}</code>', _text(value),
         *map(escape, DEFINITIONS.get(name, ('', '')))] for name, value in numbers.items()), [1])


def _manifest(manifest: Mapping[str, Any]) -> str:
    listed = flattened({name: of for name, of in manifest.items() if name != 'parameters'})
    rows = ([f'<code>{escape(name)}</code>', _text(value)] for name, value in listed.items())
    return (f'{_table(("Name", "Value"), rows)}<details><summary>Parameters</summary>'
            f'<div class="scroll"><pre>{escape(to_json(manifest.get("parameters", {})))}</pre>'
            '</div></details>')


def _figure(png: Path, title: str, caption: str = '') -> str:
    """Picture with title and caption; the URI carries the picture itself."""
    data = base64.b64encode(png.read_bytes()).decode('ascii')
    words = f'<b>{escape(title)}.</b> {escape(caption)}' if caption else escape(title)
    return (f'<figure><div class="zooms" title="{ZOOM}"><img alt="{escape(title)}" '
            f'src="data:image/png;base64,{data}"></div><figcaption>{words}</figcaption></figure>')


def _records(records: Sequence[Mapping[str, Any]], note: str = '') -> str:
    """Table of records under a note, with keys as columns as they first appear; '' without any."""
    keys = list(dict.fromkeys(key for record in records for key in record))
    numbers = [column for column, key in enumerate(keys) if all(
        isinstance(record.get(key), (int, float, type(None)))
        and not isinstance(record.get(key), bool) for record in records)]
    rows = ([_text(record.get(key)) for key in keys] for record in records)
    return note + _table([label(key) for key in keys], rows, numbers) if records else ''


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Table of cells that are HTML already; the columns ``numbers`` are set to the right."""
    kinds = [' class="number"' if column in numbers else '' for column in range(len(head))]
    heads = ''.join(f'<th scope="col"{kind}>{escape(name)}</th>'
                    for kind, name in zip(kinds, head, strict=True))
    body = ''.join('<tr>' + ''.join(f'<td{kind}>{cell}</td>' for kind, cell
                                    in zip(kinds, cells, strict=True)) + '</tr>' for cells in rows)
    return (f'<div class="scroll"><table><thead><tr>{heads}</tr></thead>'
            f'<tbody>{body}</tbody></table></div>')


def label(key: str) -> str:
    """Name of a number as a heading: ``body_still_after_s`` is ``body still after [s]``."""
    ending = next((ending for ending in UNITS if key.endswith(ending)), '')
    words = key.removesuffix(ending).replace('_', ' ')
    return f'{words} [{UNITS[ending]}]' if ending else words


def _text(value: Any) -> str:
    """Value as HTML."""
    return escape(as_text(value))
