"""Layers joined into one, and pooling before the ReLU, change nothing but the time it takes."""

import copy

import torch
from torch import nn
from torch.nn import functional

from baselines.localizers.backbones.googlenet import ConvBn, GoogLeNet, side_by_side


def textbook(layer, maps):
    """Convolution, batch normalisation, ReLU: a layer for itself, as torch's own modules do it."""
    return functional.relu(layer.bn(functional.conv2d(maps, layer.conv.weight)))


def drawn(n_in, counts):
    layers = [ConvBn(n_in, count, 1).double() for count in counts]
    for layer in layers:
        for values in (layer.bn.weight, layer.bn.bias, layer.bn.running_mean):
            nn.init.normal_(values)
    return layers


def test_layers_side_by_side_are_the_layers_one_after_the_other():
    torch.manual_seed(0)
    layers = drawn(5, (3, 8, 2))
    apart = copy.deepcopy(layers)
    for training in (True, False):
        maps = torch.randn(4, 5, 3, 3, dtype=torch.float64).to(memory_format=torch.channels_last)
        ours, theirs = maps.clone().requires_grad_(), maps.clone().requires_grad_()
        for layer in (*layers, *apart):
            layer.train(training)
        found = torch.cat(list(side_by_side(layers, ours)), dim=1)
        expected = torch.cat([textbook(layer, theirs) for layer in apart], dim=1)
        torch.testing.assert_close(found, expected)
        pull = torch.randn(found.shape, dtype=torch.float64)
        (found * pull).sum().backward()
        (expected * pull).sum().backward()
        torch.testing.assert_close(ours.grad, theirs.grad)
        for joined, single in zip(layers, apart, strict=True):
            for a, b in zip(joined.parameters(), single.parameters(), strict=True):
                torch.testing.assert_close(a.grad, b.grad)
            torch.testing.assert_close(joined.state_dict(), single.state_dict())


def test_the_stem_pools_what_the_relu_leaves():
    torch.manual_seed(0)
    network = GoogLeNet(0.125).double().eval()
    for layer in (network.conv1, network.conv3):
        nn.init.normal_(layer.bn.weight)  # of either sign
        nn.init.normal_(layer.bn.bias)
    images = torch.randn(2, 3, 40, 40, dtype=torch.float64)
    seen = []
    network.inception3a.register_forward_pre_hook(lambda _, maps: seen.append(maps[0]))
    network.maps_of(images)
    maps = network.pool3(network.conv1(images))
    torch.testing.assert_close(seen[0], network.pool3(network.conv3(network.conv2(maps))))
