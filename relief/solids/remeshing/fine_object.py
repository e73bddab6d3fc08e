"""An object as the surface that textures stand on: smooth behind its facets, in small triangles."""

import numpy as np

from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.unrolling import refined_object
from relief.solids.remeshing.smooth_surface import raised, smooth_surface


@stage("finding the object's smooth surface")
def smooth_object(body: Body, name: object) -> Body:
    """The smooth surface behind the facets of an object, with edges of about 1.5 mm at most.

    `retouch wrap` lays textures on this surface. Over the facets of a file the same texture has their shape
    as well: of a mouse of 2,060 facets V was half a just-noticeable difference too large.

    Args:
        body: A closed body, each vertex once.
        name: Of its file, for messages.

    Raises:
        InputError: That takes too many faces.
    """
    fine = refined_object(body, name)
    parent, share = fine.vertex_parents(np.ones(len(body.faces), bool))
    return Body(fine.body.vertices + raised(smooth_surface(body).bulges, parent, share), fine.body.faces)
