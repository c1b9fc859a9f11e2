# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bytes of an ONNX network that multiplies with a matrix, by the fields of onnx.proto3."""

from __future__ import annotations

import numpy as np

FLOAT, OPSET, IR_VERSION = 1, 13, 8


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _varint(value: int) -> bytes:
    low, high = value & 0x7F, value >> 7
    return bytes([low | 0x80]) + _varint(high) if high else bytes([low])


def _bytes(field: int, value: bytes | str) -> bytes:
    value = value.encode() if isinstance(value, str) else value
    return _varint(field << 3 | 2) + _varint(len(value)) + value


def _value(name: str, size: int) -> bytes:
    shape = b''.join(_bytes(1, _number(1, length)) for length in (1, size))
    return _bytes(1, name) + _bytes(2, _bytes(1, _number(1, FLOAT) + _bytes(2, shape)))


def linear_network(weights: np.ndarray) -> bytes:
    """Network a = o W with W (n, m), o (1, n), a (1, m)."""
    rows, columns = weights.shape
    tensor = (_number(1, rows) + _number(1, columns) + _number(2, FLOAT) + _bytes(8, 'W')
              + _bytes(9, weights.astype('<f4').tobytes()))
    node = _bytes(1, 'o') + _bytes(1, 'W') + _bytes(2, 'a') + _bytes(4, 'MatMul')
    graph = (_bytes(1, node) + _bytes(2, 'linear') + _bytes(5, tensor)
             + _bytes(11, _value('o', rows)) + _bytes(12, _value('a', columns)))
    return _number(1, IR_VERSION) + _bytes(7, graph) + _bytes(8, _number(2, OPSET))
