"""Where the camera goes: one module per part of section 3 of the paper."""
