"""Label methods, localizers, training and reference methods for camera localization data sets."""
