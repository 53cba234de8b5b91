"""Drawings for a plotter: SVG to lines on a wall, in an order with little travel, as G-code."""
