"""Attitude ephemeris messages made for tests."""

import numpy as np
from scipy.spatial.transform import Rotation

from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array


def kvn(quaternion: Array, tai_s: Array, **fields: str) -> str:
    meta = {
        "OBJECT_NAME": "MADE", "OBJECT_ID": "2012-025B", "CENTER_NAME": "EARTH", "REF_FRAME_A": "LVLH",
        "REF_FRAME_B": "SC_BODY_1", "TIME_SYSTEM": "UTC", "ATTITUDE_TYPE": "QUATERNION",
    } | fields  # fmt: skip
    rows = [
        f"{utc_text(float(t), 6).removesuffix('Z')} " + " ".join(f"{value:.12f}" for value in q)
        for t, q in zip(tai_s, quaternion, strict=True)
    ]
    header = [f"CCSDS_AEM_VERS = {'1.0' if 'QUATERNION_TYPE' in fields or 'ATTITUDE_DIR' in fields else '2.0'}"]
    header += ["CREATION_DATE = 2015-06-01T00:00:00", "ORIGINATOR = TEST", "", "META_START"]
    return "\n".join([*header, *(f"{k} = {v}" for k, v in meta.items()), "META_STOP", "DATA_START", *rows, "DATA_STOP"])


def quaternions(matrix: Array) -> Array:
    """Of passive rotations, scalar last, as the standard writes them: scipy's are active."""
    return np.asarray(Rotation.from_matrix(matrix).inv().as_quat())
