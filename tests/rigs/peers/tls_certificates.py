"""Certificates that signed themselves, made with openssl for tests of TLS."""

import shutil
import subprocess
from pathlib import Path

import pytest

OPENSSL = shutil.which("openssl")


P_256 = ("ec", "-pkeyopt", "ec_paramgen_curve:prime256v1")


def make_certificate(
    folder: Path, name: str = "server", *options: str, key: tuple[str, ...] = P_256
) -> tuple[Path, Path]:
    """Make a certificate for 127.0.0.1; return its file and that of its key.

    The key is encrypted only where options say so. The test is skipped where there is no openssl.
    """
    if OPENSSL is None:
        pytest.skip("no openssl to make a certificate with")
    paths = folder / f"{name}.pem", folder / f"{name}.key"
    command = [
        *(OPENSSL, "req", "-x509", "-days", "2", "-newkey", *key),
        *("-subj", "/CN=pendant server"),
        *("-addext", "subjectAltName=IP:127.0.0.1", *(options or ("-nodes",))),
        *("-keyout", str(paths[1]), "-out", str(paths[0])),
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    paths[1].chmod(0o600)
    return paths
