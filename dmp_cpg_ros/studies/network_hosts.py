# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hosts on one machine: network namespaces with a loopback and a TUN device each. Linux only.

A namespace without a name, and a device that does not persist, are there as long as somebody has
them open: whatever ends the process that made them, nothing is left.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import socket
import struct
import subprocess
import sys
from contextlib import suppress
from types import TracebackType

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.studies.lossy_link import Conditions

CLONE_NEWNET = 0x40000000
"""Of unshare(2) and setns(2); Python has both from 3.12 on."""

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
"""Of the TUN driver: make a device that hands over bare IP packets."""

SIOCSIFADDR, SIOCSIFNETMASK, SIOCGIFFLAGS, SIOCSIFFLAGS = 0x8916, 0x891C, 0x8913, 0x8914
IFF_UP, IFF_MULTICAST = 0x1, 0x1000
"""Of netdevice(7)."""

OWN, DEVICE = '/proc/self/ns/net', 'link0'


class NoHostsError(DmpCpgError):
    """Network namespaces or TUN devices may not be made here."""


class Host:
    """A network namespace with a device ``link0``.

    Parameters
    ----------
    address : str
        Of that device, in a network of 24 bits.

    Attributes
    ----------
    device : int
        Descriptor that reads what the host sends and writes what it receives.
    """

    def __init__(self, address: str) -> None:
        """Make it; this process stays where it is. Raises NoHostsError."""
        self.address = address
        before = os.open(OWN, os.O_RDONLY)
        try:
            _call('unshare', CLONE_NEWNET)
            self._namespace = os.open(OWN, os.O_RDONLY)
            try:
                self.device = _make_device(address)
            finally:
                _call('setns', before, CLONE_NEWNET)
        except OSError as error:
            raise NoHostsError(
                'no network namespaces with TUN devices here, which need CAP_SYS_ADMIN, '
                f'CAP_NET_ADMIN and /dev/net/tun ({error.strerror}): run it as root, or as '
                'unshare --user --map-root-user python -m ...') from None
        finally:
            os.close(before)

    def enter(self) -> None:
        """Let this thread, and what it starts from now on, be on the host."""
        _call('setns', self._namespace, CLONE_NEWNET)

    def close(self) -> None:
        """Give it up; it is gone when nobody is on it any more."""
        os.close(self.device)
        os.close(self._namespace)


class TwoHosts:
    """Two hosts with a link between them; a context manager.

    Parameters
    ----------
    conditions : Conditions
        Of the link at first.
    seed : int
        Of the link's draws.

    Attributes
    ----------
    hosts : tuple of two Host
        10.87.0.1 and 10.87.0.2.
    """

    def __init__(self, conditions: Conditions, seed: int) -> None:
        """Make all of it."""
        self._before = os.open(OWN, os.O_RDONLY)
        self.hosts = Host('10.87.0.1'), Host('10.87.0.2')
        devices = [host.device for host in self.hosts]
        self._link = subprocess.Popen(
            [sys.executable, '-m', 'dmp_cpg_ros.studies.lossy_link',
             *map(str, (*devices, seed))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, pass_fds=devices,
            start_new_session=True)
        self.change(conditions)

    def __enter__(self) -> TwoHosts:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Leave the hosts and end the link."""
        self.end_link()
        _call('setns', self._before, CLONE_NEWNET)
        os.close(self._before)
        for host in self.hosts:
            host.close()

    def change(self, conditions: Conditions) -> None:
        """Change what the link does to what is sent from now on."""
        assert self._link.stdin is not None
        self._link.stdin.write(conditions.line)
        self._link.stdin.flush()

    def end_link(self) -> str:
        """End the link; returns what it has done, as JSON, the first time."""
        if self._link.returncode is not None:
            return ''
        with suppress(BrokenPipeError):
            return self._link.communicate()[0]
        return ''


def _call(name: str, *arguments: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if getattr(libc, name)(*arguments):
        number = ctypes.get_errno()
        raise OSError(number, f'{name}: {os.strerror(number)}')


def _make_device(address: str) -> int:
    """Make the devices of the namespace in which this thread is; returns the TUN's descriptor."""
    device = os.open('/dev/net/tun', os.O_RDWR | os.O_CLOEXEC)
    try:
        fcntl.ioctl(device, TUNSETIFF,
                    struct.pack('16sH22x', DEVICE.encode(), IFF_TUN | IFF_NO_PI))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
            for request, value in ((SIOCSIFADDR, address), (SIOCSIFNETMASK, '255.255.255.0')):
                fcntl.ioctl(control, request, struct.pack(
                    '16sHH4s16x', DEVICE.encode(), socket.AF_INET, 0, socket.inet_aton(value)))
            for name in ('lo', DEVICE):
                _set_flags(control, name, IFF_UP if name == 'lo' else IFF_UP | IFF_MULTICAST)
    except OSError:
        os.close(device)
        raise
    return device


def _set_flags(control: socket.socket, name: str, flags: int) -> None:
    known = fcntl.ioctl(control, SIOCGIFFLAGS, struct.pack('16sH22x', name.encode(), 0))
    flags |= struct.unpack_from('16sH', known)[1]
    fcntl.ioctl(control, SIOCSIFFLAGS, struct.pack('16sH22x', name.encode(), flags))
