"""A small URDF of boxes for tests: base on the floor, torso, seven revolute joints, gripper."""

from itertools import cycle

# Where each arm joint sits in its parent, and about which axis it turns: a roll-pitch-roll arm with
# a wrist whose last three axes meet.
ARM = [
    ((0.1, 0.0, 0.5), "0 0 1", (-2.8, 2.8)),
    ((0.0, 0.0, 0.15), "0 1 0", (-1.9, 1.9)),
    ((0.0, 0.0, 0.15), "0 0 1", (-2.8, 2.8)),
    ((0.0, 0.0, 0.15), "0 1 0", (-2.2, -0.1)),
    ((0.0, 0.0, 0.3), "0 0 1", (-2.8, 2.8)),
    ((0.0, 0.0, 0.0), "0 1 0", (-1.5, 1.5)),
    ((0.0, 0.0, 0.0), "0 0 1", (-2.8, 2.8)),
]
BOXES = [
    ((0.1, 0.1, 0.1), (0, 0, 0.05)),
    ((0.08, 0.08, 0.12), (0, 0, 0.06)),
    ((0.08, 0.08, 0.12), (0, 0, 0.06)),
    ((0.07, 0.07, 0.16), (0, 0, 0.06)),
    None,
    None,
    ((0.06, 0.06, 0.05), (0, 0, 0.12)),
]


def link(name, box=None):
    if box is None:
        return f'<link name="{name}"/>'
    (size, xyz) = box
    shape = f'<geometry><box size="{" ".join(map(str, size))}"/></geometry>'
    return (
        f'<link name="{name}"><visual><origin xyz="{" ".join(map(str, xyz))}"/>{shape}</visual>'
        "</link>"
    )


def joint(name, kind, parent, child, xyz=(0, 0, 0), axis="0 0 1", limits=None):
    bounds = "" if limits is None else f'<limit lower="{limits[0]}" upper="{limits[1]}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{" ".join(map(str, xyz))}"/>'
        f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>{bounds}</joint>'
    )


def urdf(joints=7, wrist_offset=0.0):
    """Return the text of the URDF, its arm cut short or its axis 7 moved aside on request."""
    parts = [
        link("floor"),
        link("base", ((0.5, 0.5, 0.3), (0, 0, 0.15))),
        joint("base_joint", "fixed", "floor", "base"),
        link("mast", ((0.1, 0.1, 0.3), (0, 0, 0.2))),
        joint("lift", "prismatic", "base", "mast", (0, 0, 0.3), limits=(0.0, 0.4)),
        link("head", ((0.1, 0.1, 0.1), (0, 0, 0.05))),
        joint("pan", "revolute", "mast", "head", (-0.1, 0, 0.6), limits=(-1.0, 1.0)),
        joint("nod", "revolute", "head", "eyes", (0, 0, 0.05), "0 1 0", limits=(0.2, 0.8)),
        link("eyes"),
    ]
    parent = "mast"
    for i, ((xyz, axis, limits), box) in enumerate(zip(ARM[:joints], BOXES, strict=False), start=1):
        if i == 7:
            xyz = (wrist_offset, *xyz[1:])
        parts += [
            link(f"arm{i}", box),
            joint(f"a{i}", "revolute", parent, f"arm{i}", xyz, axis, limits),
        ]
        parent = f"arm{i}"
    # The tool's x points out of the fingers, as goals want it.
    tool = joint("tool_joint", "fixed", parent, "tool", (0, 0, 0.2))
    parts += [
        link("tool"),
        tool.replace('"/><parent', '" rpy="0 -1.5707963267948966 0"/><parent'),
        link("finger", ((0.02, 0.02, 0.04), (0, 0, 0.02))),
        joint("grip", "prismatic", parent, "finger", (0, 0.02, 0.145), "0 1 0", limits=(0.0, 0.04)),
    ]
    return f'<robot name="made_up">{"".join(parts)}</robot>'


def gantry(kinds="PPPRRR", telescope=True):
    """Return a URDF of prismatic (P) and revolute (R) joints, its first one with a second stage."""
    parts = [link("base", ((0.4, 0.4, 0.3), (0, 0, 0.15)))]
    slides, turns = cycle(("0 0 1", "1 0 0", "0 1 0")), cycle(("0 0 1", "0 1 0", "1 0 0"))
    parent, first = "base", True
    for i, kind in enumerate(kinds, start=1):
        if kind == "P":
            axis, box = next(slides), ((0.05, 0.05, 0.05), (0, 0, 0.0))
            moved = joint(f"j{i}", "prismatic", parent, f"l{i}", (0.1, 0, 0.15), axis, (0.0, 0.4))
        else:
            axis, box = next(turns), ((0.04, 0.04, 0.04), (0, 0, 0.0))
            moved = joint(f"j{i}", "revolute", parent, f"l{i}", (0.12, 0, 0), axis, (-1.4, 1.4))
        parts += [link(f"l{i}", box), moved]
        parent = f"l{i}"
        if first and telescope:
            follower = joint("stage", "prismatic", parent, "stage", (0.1, 0, 0.1), axis, (0.0, 0.4))
            parts += [
                link("stage", ((0.04, 0.04, 0.04), (0, 0, 0.0))),
                follower.replace("</joint>", f'<mimic joint="j{i}"/></joint>'),
            ]
            parent = "stage"
        first = False
    parts += [
        link("tool"),
        joint("tool_joint", "fixed", parent, "tool", (0.12, 0, 0)),
        link("finger", ((0.06, 0.02, 0.02), (0.03, 0, 0))),
        joint("grip", "prismatic", parent, "finger", (0.05, 0, 0), "0 1 0", limits=(0.0, 0.04)),
    ]
    return f'<robot name="gantry">{"".join(parts)}</robot>'
