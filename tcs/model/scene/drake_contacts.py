"""Drake's search for contacts between the shapes of a scene."""

from __future__ import annotations

from collections import defaultdict

from pydrake.geometry import (
    CollisionFilterDeclaration,
    CollisionFilterManager,
    GeometrySet,
    ProximityProperties,
    QueryObject,
    SceneGraph,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram

from tcs.kernel.arrays import FloatArray
from tcs.model.scene.contacts import ContactRule, Group, Part, kinds_of


class DrakeContacts:
    """Drake's search for contacts, between exactly the pairs of parts that a rule checks.

    Drake keeps a table of all pairs of shapes that have the proximity role, in the scene graph and
    in every context: seconds and hundreds of megabytes for a robot of 1,300 shapes, of no use to
    who only scores. The robot's shapes get the role in one context of their own, made when the
    search is first asked for.
    """

    def __init__(
        self,
        diagram: Diagram,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        parts: tuple[Part, ...],
        rule: ContactRule,
    ) -> None:
        """Prepare the search.

        Args:
            diagram: Plant and scene graph together.
            plant: The plant, finalized.
            scene_graph: The scene graph, in which only shapes of the environment have the role.
            parts: Every collision shape.
            rule: Which pairs of them are checked.
        """
        self._diagram = diagram
        self._plant = plant
        self._scene_graph = scene_graph
        self._parts = parts
        self._rule = rule
        self._context: Context | None = None

    def at(self, positions: FloatArray) -> QueryObject:
        """Return Drake's query object, valid until the next call.

        Args:
            positions: Those of all joints of the plant, shape (n,) [m or rad].
        """
        if self._context is None:
            self._context = self._with_roles()
        state = self._plant.GetMyMutableContextFromRoot(self._context)
        self._plant.SetPositions(state, positions)
        query: QueryObject = self._plant.get_geometry_query_input_port().Eval(state)
        return query

    def _with_roles(self) -> Context:
        """Return a context in which all parts have the role, and the rule applies."""
        context = self._diagram.CreateDefaultContext()
        state = self._scene_graph.GetMyMutableContextFromRoot(context)
        source = self._plant.get_source_id()
        for part in self._parts:
            if part.group is not Group.ENVIRONMENT:
                self._scene_graph.AssignRole(state, source, part.geometry, ProximityProperties())
        _apply(self._scene_graph.collision_filter_manager(state), self._parts, self._rule)
        return context


def _apply(manager: CollisionFilterManager, parts: tuple[Part, ...], rule: ContactRule) -> None:
    """Make Drake check exactly the pairs of the rule; it checks all but those of one body so far.

    Only pairs within the environment may already be excluded, and the rule checks none of them.
    """
    number_of, kinds = kinds_of(parts)
    geometries = defaultdict(list)
    for part, number in zip(parts, number_of, strict=True):
        geometries[number].append(part.geometry)
    declaration = CollisionFilterDeclaration()
    for i, kind in enumerate(kinds):
        own = GeometrySet(geometries[i])
        declaration.ExcludeWithin(own)
        others = range(i + 1, len(kinds))
        apart = [g for j in others if not rule.is_checked(kind, kinds[j]) for g in geometries[j]]
        declaration.ExcludeBetween(own, GeometrySet(apart))
    manager.Apply(declaration)
