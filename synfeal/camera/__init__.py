"""Cameras: intrinsics, distortion, calibration files."""
