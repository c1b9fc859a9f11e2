# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pieces of HTML: tables, figures, numbers."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.facts import Fact

MARKS = {True: ('good', '✓ holds'), False: ('bad', '✗ does not hold'), None: ('none', '–')}

UNITS = {'_m_s': 'm/s', '_s': 's', '_m': 'm', '_n': 'N'}
"""Endings of keys that name a unit."""


def figure(png: Path, title: str, caption: str = '') -> str:
    """Picture with title and caption; the URI carries the picture itself."""
    data = base64.b64encode(png.read_bytes()).decode('ascii')
    words = f'<b>{escape(title)}.</b> {escape(caption)}' if caption else escape(title)
    return (
        f'<figure><img alt="{escape(title)}" src="data:image/png;base64,{data}">'
        f'<figcaption>{words}</figcaption></figure>')


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Table of cells that are HTML already; the columns ``numbers`` are set to the right."""
    classes = [' class="number"' if index in numbers else '' for index in range(len(head))]
    heads = (f'<th scope="col"{kind}>{escape(name)}</th>'
             for name, kind in zip(head, classes, strict=True))
    return _table(''.join(heads), (
        ''.join(f'<td{kind}>{cell}</td>' for cell, kind in zip(row, classes, strict=True))
        for row in rows))


def fact_table(entries: Iterable[Fact]) -> str:
    """Facts with their findings and marks; the mark is a word too, not only a colour."""
    rows = (
        f'<td>{escape(fact.statement)}</td><td>{escape(fact.finding)}</td>'
        f'<td class="mark {MARKS[fact.holds][0]}">{MARKS[fact.holds][1]}</td>'
        for fact in entries)
    return _table('<th scope="col">Statement</th><th scope="col">Found</th><th></th>', rows)


def record_table(records: Sequence[Mapping[str, Any]]) -> str:
    """Records with their keys as columns, in the order in which the keys first appear."""
    keys = list(dict.fromkeys(key for record in records for key in record))
    numbers = [index for index, key in enumerate(keys)
               if all(_is_number(record.get(key)) for record in records)]
    rows = ([text(record.get(key)) for key in keys] for record in records)
    return table([label(key) for key in keys], rows, numbers)


def label(key: str) -> str:
    """Name of a number as a heading: ``body_still_after_s`` is ``body still after [s]``."""
    for ending, unit in UNITS.items():
        if key.endswith(ending):
            return f'{key[: -len(ending)]} [{unit}]'.replace('_', ' ')
    return key.replace('_', ' ')


def text(value: Any) -> str:
    """Value as HTML: four significant digits, yes and no, a dash for nothing."""
    if value is None:
        return '–'
    if isinstance(value, bool):
        return 'yes' if value else 'no'
    if isinstance(value, float):
        return f'{value:.4g}'
    if isinstance(value, (list, tuple)):
        return ', '.join(text(entry) for entry in value)
    return escape(str(value))


def flattened(values: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    """Nested values by dotted names; lists of mappings are left out."""
    flat: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            flat.update(flattened(value, f'{prefix}{key}.'))
        elif not (isinstance(value, list) and any(isinstance(entry, Mapping) for entry in value)):
            flat[f'{prefix}{key}'] = value
    return flat


def _table(head: str, rows: Iterable[str]) -> str:
    body = ''.join(f'<tr>{row}</tr>' for row in rows)
    head = f'<thead><tr>{head}</tr></thead>'
    return f'<div class="scroll"><table>{head}<tbody>{body}</tbody></table></div>'


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))
