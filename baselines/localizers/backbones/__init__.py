"""Convolutional backbones whose parameter names load torchvision's official ImageNet weights."""
