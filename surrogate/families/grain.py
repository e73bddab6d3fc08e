"""Lines along a grain: brushed metal, scratches, weathered wood, bark."""

import numpy as np

from relief.ground.arrays import smooth_step
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


def wood(rng: np.random.Generator, grid: Grid) -> Field:
    """Weathered wood: ridges 0.6-2.5 mm apart along the grain, fibres, pores, at times a knot."""
    angle = basics.any_direction(rng)
    spacing = basics.log_uniform(rng, 0.6, 2.5)
    u, v = basics.turned(*basics.coordinates(grid), angle)
    rings = v if rng.random() < 0.6 else _around_knot(rng, u, v)
    rings = rings + rng.uniform(-0.02, 0.02) * u**2
    rings = rings + rng.uniform(0.2, 0.8) * basics.streaks(rng, grid, 1.0, rng.uniform(2.0, 5.0), angle)
    place = (rings / spacing + 0.25 * basics.smooth_noise(rng, grid, 2.5)) % 1.0
    steep = rng.uniform(0.15, 0.3)
    ridges = place ** rng.uniform(1.0, 2.5) * (1 - smooth_step((place - 1 + steep) / steep))
    fibres = rng.uniform(0.04, 0.15) * basics.streaks(rng, grid, 0.06, rng.uniform(10.0, 25.0), angle)
    pores = smooth_step((basics.streaks(rng, grid, 0.07, 7.0, angle) - rng.uniform(1.3, 2.2)) / 0.6)
    return basics.unit(ridges + fibres - rng.uniform(0.0, 0.5) * pores)


def _around_knot(rng: np.random.Generator, u: Field, v: Field) -> Field:
    """Rings in mm: round in a knot of radius 0.5-1.2 mm, which the grain passes as a stream a pillar."""
    du, dv = (u - rng.uniform(-4, 4)) / rng.uniform(1.0, 1.8), v - rng.uniform(-4, 4)
    radius = rng.uniform(0.5, 1.2)
    squared = np.maximum(du**2 + dv**2, 1e-6)
    stream = dv * (1 - radius**2 / np.maximum(squared, radius**2))
    return stream + 1.5 * np.minimum(np.sqrt(squared) - radius, 0.0)


def bark(rng: np.random.Generator, grid: Grid) -> Field:
    """Bark: rough plates 0.8-2.5 mm wide and 2-5 times as long between deep, winding furrows."""
    angle = grid.direction(basics.any_direction(rng))
    spacing = basics.log_uniform(rng, 0.8, 2.5)
    longer = rng.uniform(2.0, 5.0)
    u, v = basics.turned(*basics.coordinates(grid), angle)
    bend = spacing * rng.uniform(0.08, 0.2)
    u = (u + bend * basics.rough_noise(rng, grid, 2 * spacing, 2.2)) / longer
    v = v + bend * basics.rough_noise(rng, grid, 2 * spacing, 2.2)
    points = basics.scattered(rng, grid, spacing, rng.uniform(0.4, 0.6), squeeze=longer)
    distance, plate = basics.border_distance(points, u, v, grid.period(longer))
    tall = rng.uniform(0.6, 1.0, len(points))[plate]
    plates = tall * smooth_step(distance / (spacing * rng.uniform(0.25, 0.5))) ** rng.uniform(0.6, 1.0)
    rough = basics.streaks(rng, grid, 0.12, rng.uniform(2.0, 5.0), angle)
    rugged = rng.uniform(0.02, 0.08) * rough + rng.uniform(0.01, 0.05) * basics.rough_noise(
        rng, grid, 1.5, 1.2
    )
    return basics.unit(plates + rugged)
