# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables that read well in a terminal and in a README."""

from __future__ import annotations

from collections.abc import Sequence


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lines of a Markdown table with columns of even width.

    Parameters
    ----------
    columns : sequence of str
        Headings.
    rows : sequence of sequence of str
        One cell per column.

    Returns
    -------
    str
    """
    widths = [max(len(row[i]) for row in (columns, *rows)) for i in range(len(columns))]
    rule = ['-' * width for width in widths]
    return '\n'.join(
        f"| {' | '.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))} |"
        for row in (columns, rule, *rows)
    )
