"""Finding a table with a laser scanner: its pose in the base frame, and the covariance.

In: scans, measured or simulated by ray casting in a scene (`tcs.perception.simulation`, which needs
Drake), and a table with its legs. Out: the pose that `tcs select`, task maps and ARPlace take.
"""

from __future__ import annotations

from tcs.perception.located import Located, load_located
from tcs.perception.locating import locate
from tcs.perception.planar_pose import PlanarPose
from tcs.perception.scanner import TIAGO, LaserScanner
from tcs.perception.scans import Scans, read_scans, write_scans
from tcs.perception.table_file import Leg, TableFile, load_table

__all__ = [
    "TIAGO",
    "LaserScanner",
    "Leg",
    "Located",
    "PlanarPose",
    "Scans",
    "TableFile",
    "load_located",
    "load_table",
    "locate",
    "read_scans",
    "write_scans",
]
