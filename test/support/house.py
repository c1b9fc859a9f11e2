# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Size and reach of the product: code lines by folder, and what no entry point imports.

``python test/support/house.py`` prints the table of code lines.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections import Counter
from pathlib import Path

from checkout import PACKAGE, ROOT, imports, modules, setup_constant

_NO_CODE = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
            tokenize.ENDMARKER}


def code_lines(path: Path) -> int:
    """Lines of a file that hold code: no blank lines, comments or docstrings."""
    source = path.read_text(encoding='utf-8')
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(source)):
        if (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
                and isinstance(node.value.value, str)):
            lines -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def size() -> Counter[str]:
    """Code lines of the product by folder, those of the core by its folders."""
    counted: Counter[str] = Counter()
    for name, path in modules().items():
        words = name.split('.')[1:]
        place = '.'.join(words[:2] if words[:1] == ['core'] else words[:1]) or PACKAGE
        counted[place] += code_lines(path)
    return counted


def reached() -> set[str]:
    """Modules that are imported, in any number of steps, by what users start.

    They start the executables of ``setup.py`` and what the Makefile and the documents start with
    ``python -m``; what the table of equations names of ``paper`` is a library for readers. A
    module that is named in a text, as the classes of the nodes are, is imported.
    """
    known = modules()
    executables = setup_constant('EXECUTABLES')
    assert isinstance(executables, tuple)
    todo = {f'{PACKAGE}.__main__'} | {
        name for name in known if name.split('.')[-1] in executables}
    texts = [ROOT / 'Makefile', ROOT / 'README.md', *ROOT.glob('doc/*.md'),
             *ROOT.glob('launch/*.py')]
    pattern = re.compile(rf'{PACKAGE}(?:\.\w+)+')
    todo |= {name for text in texts
             for found in pattern.findall(text.read_text(encoding='utf-8'))
             for name in _prefixes(found) if name in known}
    equations = (ROOT / 'doc' / 'equations.md').read_text(encoding='utf-8')
    todo |= {name for found in re.findall(r'`(paper(?:\.\w+)+)`', equations)
             for name in _prefixes(f'{PACKAGE}.{found}') if name in known}
    done: set[str] = set()
    while todo:
        name = todo.pop()
        done.add(name)
        source = known[name].read_text(encoding='utf-8')
        strings = {node.value for node in ast.walk(ast.parse(source))
                   if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        named = {found for text in strings for found in pattern.findall(text)
                 if '\n' not in text}
        for other in imports(name, known[name]) | named:
            todo |= {prefix for prefix in _prefixes(other) if prefix in known} - done
    return done


def _prefixes(dotted: str) -> list[str]:
    words = dotted.split('.')
    return ['.'.join(words[:count]) for count in range(1, len(words) + 1)]


if __name__ == '__main__':
    for place, count in sorted(size().items()):
        print(f'{count:6d} {place}')
    print(f'{sum(size().values()):6d} in all')
    for module in sorted(set(modules()) - reached()):
        print('only tests reach', module)
