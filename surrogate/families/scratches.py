"""Lines drawn over a surface: brushed metal, scratches."""

import numpy as np

from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid


def brushed(rng: np.random.Generator, grid: Grid) -> Field:
    """Metal brushed along one direction: grooves 0.25-0.8 mm wide and 15-60 times as long, some deeper."""
    angle = basics.any_direction(rng)
    blur = basics.log_uniform(rng, 0.06, 0.2)
    stretch = basics.log_uniform(rng, 15.0, 60.0)
    fine = basics.streaks(rng, grid, blur, stretch, angle)
    broad = basics.streaks(rng, grid, 3 * blur, stretch / 3, angle)
    grooves = fine + rng.uniform(0.2, 1.0) * broad
    return basics.unit(grooves - rng.uniform(0.0, 0.8) * np.maximum(-grooves - 0.5, 0.0))


def scratches(rng: np.random.Generator, grid: Grid) -> Field:
    """12-90 grooves a plate, 0.2-0.6 mm wide and 3-20 mm long with raised shoulders, crossing or parallel."""
    x, y = basics.coordinates(grid)
    heights = rng.uniform(0.0, 0.15) * basics.rough_noise(rng, grid, 2.0, 1.5)
    main, spread = basics.any_direction(rng), rng.choice([0.05, 0.3, np.pi])
    half_width = rng.uniform(0.1, 0.2)
    for _ in range(int(basics.log_uniform(rng, 12, 90) * grid.plates)):
        angle = main + spread * rng.uniform(-0.5, 0.5)
        along, across = basics.turned(x, y, angle)
        start, side = rng.uniform(-0.6, 0.6, 2) * grid.side_mm
        length = basics.log_uniform(rng, 3.0, 20.0)
        bend = rng.normal(0.0, 0.01)
        width = half_width * rng.uniform(0.6, 1.5)
        depth = rng.uniform(0.2, 1.0)
        along = along - start
        squared = ((across - side - bend * along**2) / width) ** 2
        scratched = (squared < 9) & (np.abs(along) < length / 2)
        taper = 1 - (2 * along[scratched] / length) ** 2
        near = squared[scratched]
        heights[scratched] -= depth * taper * (1 - 0.5 * near) * np.exp(-near / 2)
    return basics.unit(heights)
