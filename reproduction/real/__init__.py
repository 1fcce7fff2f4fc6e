"""From a scan to real photographs: what is trained on what, and tested on which photographs."""
