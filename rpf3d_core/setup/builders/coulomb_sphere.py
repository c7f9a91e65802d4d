"""Build the rebound and ground models of spheres from a scene; importing this module registers their rules."""

from rpf3d_core.kinetics.coulomb_sphere import MATERIALS_OWN, CoulombSphere
from rpf3d_core.kinetics.sphere_ground import SphereGround
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.sphere import CoulombSphereSpec, SphereGroundSpec
from rpf3d_core.simulation import sphere as sphere  # the import registers its rules
from rpf3d_core.terrain.facets import Terrain


def sphere_of(spec: CoulombSphereSpec, scene: Scene, terrain: Terrain) -> CoulombSphere:
    """Return the rebound model of a rigid sphere, built from the scene's parameters."""
    if scene.engine != "compiled":
        from rpf3d_core.detection import vtk_swept  # noqa: F401  (needed by the reference engine only)
    friction = MATERIALS_OWN if spec.impact_friction is None else spec.impact_friction
    return CoulombSphere(friction, spec.tangential_restitution)


def sphere_ground_of(spec: SphereGroundSpec, scene: Scene, terrain: Terrain) -> SphereGround:
    """Return the ground model of a rigid sphere, which rolls and slides; it has no parameters."""
    return SphereGround()
