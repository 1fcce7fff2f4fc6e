"""Convolutional backbones whose parameter names load torchvision's official ImageNet weights."""


def scaled_channels(channels: int, width: float, multiple: int = 8) -> int:
    """Round ``channels * width`` to a multiple, at least one multiple; unchanged at width 1.

    Vectorised convolutions work on blocks of eight channels, so other counts save no time.
    """
    if width == 1.0:
        return channels
    return max(multiple, multiple * round(channels * width / multiple))
