"""Other fingers: skins of other stiffness and receptor depth, and how rough reliefs feel to them.

Force over modulus and receptor depth decide how rough a relief feels; Poisson's ratio hardly counts. People
differ in both, and the numbers of a given finger are unknown. The set is therefore a range, not a sample.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import ArrayLike
from scipy import ndimage

from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.progress import stage
from relief.ground.threads import one_torch_thread
from tactile.layer.cosine_layer import sliding_layer
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.pair_variation import roughness
from tactile.pressing import Press
from tactile.skin import Skin

VARIATIONS = (
    ("this finger", 1.0, 1.0),
    ("softer skin", 0.5, 1.0),
    ("stiffer skin", 2.0, 1.0),
    ("shallower receptors", 1.0, 2.0 / 3.0),
    ("deeper receptors", 1.0, 4.0 / 3.0),
)
"""Name, factor of Young's moduli and factor of the receptor depth of each finger. Of the default skin: 0.25,
0.5 and 1 MPa, and 0.5, 0.75 and 1 mm."""
MOST_SAMPLES = 160
"""Most samples a side that are pressed; a finer patch is resampled by cubic splines, which keep its peaks."""


@dataclass(frozen=True)
class Finger:
    """A finger of the set.

    Attributes:
        name: in two words, as tables show it.
        skin: its parameters.
    """

    name: str
    skin: Skin


def fingers(skin: Skin) -> tuple[Finger, ...]:
    """The set of fingers about one skin; the first is the skin itself.

    Twice the modulus feels the same as half the force. Receptors that would lie in the bone lie halfway
    between those of the given skin and the bone instead.
    """
    return tuple(Finger(name, _varied(skin, *factors)) for name, *factors in VARIATIONS)


def _varied(skin: Skin, stiffness: float, depth: float) -> Skin:
    deeper = depth * skin.depth_mm
    if deeper >= skin.thickness_mm:
        deeper = 0.5 * (skin.depth_mm + skin.thickness_mm)
    layers = tuple((thickness, stiffness * modulus) for thickness, modulus in skin.layers)
    modulus = stiffness * skin.young_modulus_mpa
    return replace(skin, young_modulus_mpa=modulus, depth_mm=deeper, layers=layers)


def roughness_by_finger(heights: ArrayLike, skin: Skin, size_mm: float = PATCH_SIDE_MM) -> Array:
    """Roughness of patches to each finger of the set; see `roughness_by_skin`.

    Returns:
        (fingers, k), in the order of `fingers`.
    """
    return roughness_by_skin(heights, skin, [finger.skin for finger in fingers(skin)], size_mm)


@stage("pressing with other fingers")
@one_torch_thread()
def roughness_by_skin(
    heights: ArrayLike, skin: Skin, others: Sequence[Skin], size_mm: float = PATCH_SIDE_MM
) -> Array:
    """Roughness of patches to skins of other moduli and receptor depths, by the layer in single precision.

    What free sides add to the strain is taken at the receptor depth of the given skin, so that no operator is
    built for the other depths: over six textures raised by 0.3 mm, V of the other depths errs by up to 3.7 %,
    and the difference from the original by at most 0.04 of a just-noticeable difference up to 2 of them.

    Args:
        heights: (k, n, n) mm; patches of more than `MOST_SAMPLES` samples a side are resampled to as many.
            Minus infinity where there is nothing below a round finger, on patches that are not resampled.
        skin: the finger that the others are about.
        others: the same but for force, receptor depth, and all moduli by one factor.
        size_mm: side of the patch.

    Returns:
        (others, k).

    Raises:
        InputError: the patch is too small, or too coarse, for a roughness.
        ContactError: a contact does not converge.
    """
    fine = np.array(heights, dtype=np.float32)
    if (factor := MOST_SAMPLES / fine.shape[-1]) < 1.0:
        fine = ndimage.zoom(fine, (1.0, factor, factor), order=3, mode="mirror", grid_mode=True)
    patches = torch.from_numpy(fine)
    there = torch.isfinite(patches).to(patches.dtype)
    # A flat plate is pressed along: its strain is subtracted.
    patches = torch.cat((patches, torch.zeros_like(patches[:1])))
    operator = elastic_layer_operator(skin, patches.shape[-1], size_mm, patches.dtype)
    pressures = dict[float, torch.Tensor]()
    rows = []
    for other in others:
        # Displacements depend on the load alone, and contact does not depend on the depth of the receptors.
        press = Press.of(other, at_depth(operator, other))
        if press.load not in pressures:
            pressures[press.load] = press.pressure(patches)
        strain = press.felt(pressures[press.load])
        # Pairs of receptors that a round finger touches on a flat plate, with the plate below.
        flat = pressures[press.load][-1]
        receptors = None if skin.shape == "flat" else (flat > 0.0) * there
        value = roughness(strain[:-1] - strain[-1], size_mm, "thinned", receptors)
        rows.append(value.double().numpy())
    return np.stack(rows)


def at_depth(operator: ElasticLayerOperator, skin: Skin) -> ElasticLayerOperator:
    """The operator with the layer's strain at the receptor depth of a skin; free sides as they are."""
    symbols = sliding_layer(skin, operator.samples, operator.size_mm).strain_symbols
    return replace(operator, strain_symbols=symbols.to(operator.symbol.dtype))
