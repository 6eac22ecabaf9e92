"""Only what draws needs matplotlib."""

from conftest import run_python

DRAWING = {"drawing"} | {f"reproduce.figures{part}" for part in ("", "_2_3", "_5_3", "_6_3", "_7_3_5", "_spatial")}


def test_nothing_but_the_figures_needs_matplotlib(tmp_path):
    code = f"""
        import importlib, pkgutil, sys
        sys.modules["matplotlib"] = None
        import snake_env
        names = [module.name for module in pkgutil.walk_packages(snake_env.__path__, "snake_env.")]
        optional = {{"snake_env.sb3", "snake_env.rllib", "snake_env.rendering", "snake_env.__main__"}}
        for name in names:
            if name not in optional and name.removeprefix("snake_env.") not in {DRAWING}:
                importlib.import_module(name)
        from snake_env.__main__ import main
        assert main(["reproduce", "--quick", "--section", "7.5.2", "--out", {str(tmp_path)!r}]) == 0
        print("done", len(names) > 30)
    """
    assert run_python(code).splitlines()[-1] == "done True"


def test_the_figures_do_need_it():
    code = f"""
        import importlib, sys
        sys.modules["matplotlib"] = None
        for name in {sorted(DRAWING)}:
            try:
                importlib.import_module(f"snake_env.{{name}}")
            except ImportError:
                print(name)
    """
    assert run_python(code).splitlines() == sorted(DRAWING)
