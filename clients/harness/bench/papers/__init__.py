"""Figures of the source papers redrawn on our techniques, and cost curves: bench --figures.

A figure is data (figure.py): groups of frames to be measured, what is drawn of them, and the paper's
ratios beside ours. One module a figure; FIGURES lists them in the page's order. Here matplotlib is
loaded in panels.py alone.
"""
from importlib import import_module

FIGURES = ("fly_through", "resolution", "thresholds", "neighbourhood", "per_vpl", "gather_or_splat",
           "eye_error", "light_path", "clusters", "tree", "combined", "films", "compensation", "photons", "points", "cost")


def load_figure(name):
    return import_module(f".{name}", __package__).FIGURE
