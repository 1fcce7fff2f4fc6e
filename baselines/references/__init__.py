"""Methods that localizers are compared with: image retrieval, an oracle, structure-based poses.

descriptors.py describes images as a whole, features.py in parts; correspondences.py matches parts.
None of them reads a label, so each is computed once for all label sets of a data set. evidence.py
hands it to the methods (retrieval.py, structure.py, adjustment.py, scene_coordinates.py);
registry.py lists them; run.py answers and scores a data set.

The same parts make a product: map_frames.py reads posed frames, mapped.py builds a map of them,
photographs.py finds photographs in it, confidence.py says whether that could be chance, and
localized.py is ``synfeal localize`` with a map.
"""
