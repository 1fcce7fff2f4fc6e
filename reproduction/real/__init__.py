"""From a scan to real photographs: design, stages, scores, tables and figures."""
