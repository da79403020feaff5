from tests.fresh import fresh


def test_choosing_needs_neither_simulator_nor_compiler():
    code = (
        "import sys, tcs.placement.selection, tcs.placement.store, tcs.placement.tables;"
        "print([m for m in ('pydrake', 'numba', 'matplotlib') if m in sys.modules])"
    )
    assert fresh(code) == "[]"


def test_scenes_and_populations_need_no_meshes_or_statistics():
    code = (
        "import sys, tcs.model.scene, tcs.placement.population;"
        "print([m for m in ('trimesh', 'scipy.stats') if m in sys.modules])"
    )
    assert fresh(code) == "[]"
