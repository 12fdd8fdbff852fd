"""Where a long computation writes, as argparse types: what cannot be written is told before the computation begins."""

import os
from argparse import ArgumentTypeError
from pathlib import Path

from matplotlib.backend_bases import FigureCanvasBase


def output_file(text: str) -> Path:
    """A file that can be written.  ArgumentTypeError: why it cannot."""
    path = Path(text)
    if path.is_dir():
        raise ArgumentTypeError(f"{path} is a directory; give a file's name")
    if not path.parent.is_dir():
        raise ArgumentTypeError(f"{path}: there is no directory {path.parent}; make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise ArgumentTypeError(f"{path} cannot be written: permission denied")
    return path


def output_picture(text: str) -> Path:
    """A picture that can be written, of a kind that its name says.  ArgumentTypeError: why it cannot."""
    kinds = FigureCanvasBase.get_supported_filetypes()
    if Path(text).suffix.removeprefix(".").lower() not in kinds:
        raise ArgumentTypeError(f"{text}: expected a name that ends in .png, .svg, .pdf or the like")
    return output_file(text)


def output_folder(text: str) -> Path:
    """A directory, made here where it is not there yet.  ArgumentTypeError: why it cannot."""
    path = Path(text)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ArgumentTypeError(f"{path} cannot be made a directory: {error.strerror}") from None
    if not os.access(path, os.W_OK):
        raise ArgumentTypeError(f"{path} cannot be written: permission denied")
    return path
