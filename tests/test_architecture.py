"""The arrows of the design do not turn back, and the installed package is the tree."""

import ast
import itertools
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from tests.size import counted

ROOT = Path(__file__).parents[1]
# where the package's modules stand in the checkout (package-dir of pyproject.toml)
FOLDERS = {"shellmb.forms": ROOT / "forms", "shellmb.demos": ROOT / "demos"}
FOLDERS["shellmb"] = ROOT / "shellmb"
# evidence, which is run from a checkout and not installed
BENCH, PAPER = "tests.bench", "demos.paper"
FOLDERS |= {BENCH: ROOT / "tests/bench", PAPER: ROOT / "demos/paper"}
EVIDENCE = (BENCH, PAPER)
EVIDENCE += tuple(f"shellmb.demos.{name}" for name in ("effects", "studies", "verification"))

# a layer imports only layers of a smaller rank, and itself
FIRST = ("errors", "arrays", "restart", "clock", "barrier", "guarding", "files")
FIRST += ("stopping", "libraries")
FLOW = ("scene", "options", "native", "meshes", "forms", "system", "model", "schemes")
FLOW += ("preprocessing", "simulate", "observers", "diagnostics", "show", "running", "exchange")
FLOW += ("accuracy", "sensitivity", "api", "cli", "demos")
RANK = {name: rank for rank, name in enumerate((*FIRST, *FLOW))}
# a floor stands above all that it imports; the demos are the highest one
MOST_FLOORS = 14

# beside UFL what Python's own library has
FORMS_MAY_IMPORT = {"ufl", "__future__", "collections", "contextlib", "contextvars", "dataclasses"}
FORMS_MAY_IMPORT |= {"math", "typing"}
# rooms of machine code, where what FFCx, UFL, DOLFINx and PETSc do not promise is used
NATIVE = ("shellmb.native", "shellmb.system.assembly")
# names with an underscore that Python documents
DOCUMENTED = {"_asdict", "_exit", "_replace"}
# what is put in the place of others': streams and warnings as Python's documentation allows it
REPLACED = {
    "shellmb.cli.failures": {"sys.stdout", "sys.stderr", "warnings.showwarning"},
}
HEAVY = {"dolfinx", "basix", "ffcx", "ufl", "petsc4py", "slepc4py", "mpi4py", "gmsh"}
MAX_LINES = 500
# modules of one folder; scenes that a user starts by name stay beside one another
MAX_MODULES, NO_ROOM = 12, {"demos"}


# Code lines of shellmb and forms together, without blank ones, comments and docstrings, as
# `python -m tests.size` prints them. Both numbers are those of the last landing: none may be
# exceeded, and whoever lands less writes down less. A core that stands beside the one that it
# replaces is added as a term of its own, with the name of the branch that takes it away again.
# 3 658 of the lines of Python are relaxation, responses, failure, exchange and membranes.
MOST_LINES = {"Python": 54_266, "C": 2_035}
# so much less than that, and it has to be written down
LESS = 300


def modules() -> dict[str, Path]:
    """Every module of the package by its import name."""
    found = {}
    for package, folder in FOLDERS.items():
        for path in folder.rglob("*.py"):
            of_paper = package != PAPER and path.is_relative_to(FOLDERS[PAPER])
            if of_paper or path.name.startswith("test_"):
                continue
            parts = [package, *path.relative_to(folder).with_suffix("").parts]
            found[".".join(parts).removesuffix(".__init__")] = path
    return found


MODULES = modules()


@cache
def parsed(module: str) -> list[ast.AST]:
    """All nodes of a module's tree; the first one is the module."""
    return list(ast.walk(ast.parse(MODULES[module].read_text())))


@cache
def imports(module: str) -> list[str]:
    """Absolute names of all that a module imports, wherever in the file it does so."""
    found, path = list[str](), MODULES[module]
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in parsed(module):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *filter(None, [node.module])])
            # of a package, a module may be imported: `from shellmb import scene`
            names = [f"{source}.{alias.name}" for alias in node.names]
            found += [name if name in MODULES else source for name in names]
    return found


def layer(module: str) -> str | None:
    """Layer of a module of this package; None for another package or `shellmb` itself."""
    parts = module.split(".")
    return parts[1] if parts[0] == "shellmb" and len(parts) > 1 else None


def evidence(module: str) -> bool:
    """Whether a module is not installed."""
    return module.startswith(EVIDENCE)


def crossing(modules: Iterable[str], forbidden: Callable[[str], bool]) -> list[str]:
    """Imports that must not be, as "module imports name".

    Args:
        modules: Modules that are looked at; there must be some.
        forbidden: Says of an absolute name whether none of them may import it.
    """
    looked_at = sorted(modules)
    assert looked_at
    return [f"{m} imports {name}" for m in looked_at for name in imports(m) if forbidden(name)]


def test_imports_follow_the_flow() -> None:
    found = []
    for module in sorted(MODULES):
        own = layer(module)
        if (evidence(module) and own != "demos") or own is None:
            # not in the package, see test_nothing_installed_needs_a_checkout; and
            # shellmb/__init__.py, see test_light_imports
            continue
        if own not in RANK:
            found.append(f"say in RANK of this test where the new layer '{own}' stands")
            continue
        for name in imports(module):
            other = layer(name)
            if other is None or other == own:
                continue
            if other not in RANK:
                found.append(f"{module} imports {name}, which is no module of the package")
            elif RANK[other] >= RANK[own]:
                found.append(f"{module} ({own}) imports {name} ({other})")
    assert not found, "\n".join(found)


# what stands in a scene's name of a scheme is known to the schemes and to a table of their traits;
# where the studies' reference comes from is a choice
NAMES_OF_SCHEMES = {"shellmb.scene.schemes": 4, "shellmb.accuracy.studies.sweep": 2}


def test_names_of_schemes_stand_in_their_rooms() -> None:
    found = Counter(
        module
        for module in MODULES
        if layer(module) not in (None, "schemes", "demos")
        for node in parsed(module)
        if isinstance(node, ast.Constant) and node.value in ("ep", "ed", "ep4", "ed3")
    )
    found["shellmb.scene.schemes"] -= 1  # the simplest one
    assert found == NAMES_OF_SCHEMES


@cache
def floor(room: str) -> int:
    """Floor of a room: one above the highest one that it imports."""
    inside = (m for m in MODULES if layer(m) == room)
    below = {layer(name) for m in inside for name in imports(m)} - {room, None, "demos"}
    return 1 + max(map(floor, filter(None, below)), default=0)


def test_there_are_few_floors() -> None:
    """A reader climbs them one by one; the order of `FIRST` and `FLOW` makes sure that it ends."""
    assert max(map(floor, set(RANK) - {"demos"})) <= MOST_FLOORS - 1


def test_forms_import_only_ufl() -> None:
    def forbidden(name: str) -> bool:
        if name.split(".")[0] == "shellmb":
            return layer(name) not in (None, "forms")
        return name.split(".")[0] not in FORMS_MAY_IMPORT

    found = crossing((m for m in MODULES if layer(m) == "forms"), forbidden)
    assert not found, "\n".join(found)


def test_scene_and_references_know_no_finite_elements() -> None:
    references = (m for m in MODULES if m.startswith("shellmb.demos.references"))
    light = (*(m for m in MODULES if layer(m) in ("scene", "errors")), *references)
    found = crossing(light, lambda name: name.split(".")[0] in HEAVY)
    assert not found, "\n".join(found)


def test_system_knows_no_shells() -> None:
    shells = {"scene", "meshes", "forms", "model", "schemes"}
    systems = (m for m in MODULES if layer(m) == "system")
    found = crossing(systems, lambda name: layer(name) in shells)
    assert not found, "\n".join(found)


def test_nobody_depends_on_observers() -> None:
    free = {*FLOW[FLOW.index("show") :], "diagnostics", "observers"}
    others = (m for m in MODULES if layer(m) not in free and not evidence(m))
    found = crossing(others, lambda name: layer(name) == "observers")
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("module", "allowed"),
    [
        ("shellmb", set[str]()),
        ("shellmb.scene", set[str]()),
        ("shellmb.demos.references", set[str]()),
        ("shellmb.forms", {"ufl"}),
    ],
)
def test_light_imports(module: str, allowed: set[str]) -> None:
    """Through everything they import in turn, too: bad scenes fail before anything heavy loads."""
    code = f"import sys, {module}; print(*{{name.split('.')[0] for name in sys.modules}})"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert set(result.stdout.split()) & HEAVY <= allowed


def own_names() -> set[str]:
    """All names that the package gives to anything: attributes of these names are its own."""
    found: set[str] = set()
    for node in itertools.chain.from_iterable(map(parsed, MODULES)):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                found.add(name)
            case ast.Name(id=name, ctx=ast.Store()):
                found.add(name)
            case ast.Attribute(attr=name, value=ast.Name(id="self" | "cls"), ctx=ast.Store()):
                found.add(name)
    return found


def test_private_names_of_others_are_used_in_native_rooms_only() -> None:
    own, found = own_names() | DOCUMENTED, set()
    for module in MODULES:
        if module.startswith(NATIVE):
            continue
        for node in parsed(module):
            names = []
            if isinstance(node, ast.Attribute):
                names = [node.attr]
            elif isinstance(node, ast.ImportFrom) and layer(node.module or "") is None:
                names = [alias.name for alias in node.names]
            found |= {(module, n) for n in names if re.match("_[^_]", n) and n not in own}
    assert not found


def replacements(module: str) -> set[str]:
    """Attributes of what a module imports from others that it assigns, deletes or sets."""
    nodes, imported, found = parsed(module), set(), set()
    for node in nodes:
        if isinstance(node, ast.Import):
            imported |= {(alias.asname or alias.name).split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported |= {alias.asname or alias.name for alias in node.names}
    for node in nodes:
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store | ast.Del):
            root = node.value
            while isinstance(root, ast.Attribute | ast.Subscript):
                root = root.value
            if isinstance(root, ast.Name) and root.id in imported:
                found.add(ast.unparse(node))
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("setattr", "delattr"):
            if ast.unparse(node.args[0]) in imported:
                found.add(ast.unparse(node))
    return found


def test_nothing_of_others_is_replaced() -> None:
    """Python's library, UFL, DOLFINx and PETSc run as they were written; FFCx but for a search."""
    ours = [module for module in MODULES if module.startswith("shellmb")]
    found = {module: names for module in ours if (names := replacements(module))}
    streams = found.pop("shellmb.guarding", set())
    assert streams <= {"setattr(sys, name, open(os.devnull, mode))"}
    assert found == REPLACED


def test_docstrings_begin_with_what_a_thing_is_or_does() -> None:
    """A first line is a noun or a verb phrase, and needs no other docstring to be understood."""
    begins = re.compile(
        r"(The same|As (of|in|for|from)|Those|That (of|is)|Its?|They|Them"
        r"|Whether|What|Which|Who|Where|When|Why|How)\b"
    )
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef
    found = [
        f"{module}.{getattr(node, 'name', '')}: {text.splitlines()[0]}"
        for module in MODULES
        for node in parsed(module)
        if isinstance(node, kinds) and (text := ast.get_docstring(node)) and begins.match(text)
    ]
    assert not found


# what the field has other words for (docs/reference/glossary.md)
NO_WORDS = {
    "anystrain",
    "asked",
    "blame",
    "calling",
    "inframe",
    "leap",
    "leftout",
    "living",
    "lost",
}
NO_WORDS |= {"pathwork", "seldom", "soundness", "stressed", "swing", "waiting"}


def test_names_have_the_words_of_the_field() -> None:
    found = set()
    for module in (m for m in MODULES if layer(m) not in (None, "demos")):
        names = {module.rpartition(".")[2]}
        for node in parsed(module):
            names |= {str(getattr(node, kind, "")) for kind in ("name", "id", "attr", "arg")}
        words = {name: {w.lower() for w in re.findall("[A-Z]?[a-z]+", name)} for name in names}
        found |= {(module, name) for name in names if words[name] & NO_WORDS}
    assert not found


def test_loops_in_c_are_called_by_the_rooms_that_have_them() -> None:
    """Others reach them through the operations, which the reference has, too."""
    rooms = ("shellmb.native", "shellmb.system", BENCH)
    users = {m for m in MODULES if "shellmb.native.library" in set(imports(m))}
    assert all(module.startswith(rooms) for module in users)


def test_descriptors_of_the_process_stay_open() -> None:
    """Only streams that were closed when shellmb began are opened, under the numbers they have."""
    taking = {"os.dup", "os.dup2", "os.closerange"}
    found = {
        m
        for m in MODULES
        for n in parsed(m)
        if isinstance(n, ast.Attribute | ast.Name) and ast.unparse(n) in taking
    }
    assert found == {"shellmb.guarding"}


def test_measuring_knows_nobody_who_measures() -> None:
    users = "accuracy.studies", "accuracy.request", "demos"
    measuring = (m for m in MODULES if m.startswith("shellmb.accuracy.measuring"))
    found = crossing(measuring, lambda name: name.startswith(tuple(f"shellmb.{u}" for u in users)))
    assert not found, "\n".join(found)


def test_setuptools_lists_every_package() -> None:
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    packages = {name for name, path in MODULES.items() if path.name == "__init__.py"}
    assert sorted(listed) == sorted(name for name in packages if not evidence(name))
    with_code = {path.parent for path in MODULES.values()}
    assert with_code == {path.parent for path in MODULES.values() if path.name == "__init__.py"}


def test_nothing_installed_needs_a_checkout() -> None:
    """No benchmark, figure or test is in a wheel: nothing that is knows any of them."""
    installed = (m for m in MODULES if not evidence(m))
    absent = (*EVIDENCE, "demos", "tests")
    found = crossing(installed, lambda name: name.startswith(absent))
    assert not found, "\n".join(found)


# what strains of eq. (9) and of beams are made of; each in the one function that is its writing
WRITINGS = {
    "shellmb.forms.shell": ("membrane_strain", "bending_strain", "shear_strain"),
    "shellmb.forms.beam": ("axial_strain", "shear_strains", "curvatures"),
}
TANGENTS = {"x1", "x2", "d1", "d2", "ds"}


def strain_products(node: ast.AST) -> Iterator[ast.Call]:
    """Products of two vectors that strains are made of, such as `ufl.dot(a.x1, b.x2)`."""
    for call in ast.walk(node):
        if isinstance(call, ast.Call) and len(call.args) == 2:
            bare = [a.value if isinstance(a, ast.Subscript) else a for a in call.args]
            named = [a.attr for a in bare if isinstance(a, ast.Attribute)]
            if len(named) == 2 and set(named) & TANGENTS and set(named) <= TANGENTS | {"d"}:
                yield call


def test_one_definition_of_each_strain() -> None:
    for module, path in MODULES.items():
        if layer(module) not in ("forms", "model"):
            continue
        tree = ast.parse(path.read_text())
        functions = {f.name: f for f in tree.body if isinstance(f, ast.FunctionDef)}
        within = 0
        for name in WRITINGS.get(module, ()):
            assert any(strain_products(functions[name])), f"{name} is not written in {module}"
            within += len(list(strain_products(functions[name])))
        assert len(list(strain_products(tree))) == within, f"{module} writes a strain of its own"


def test_a_body_knows_no_scheme() -> None:
    """What a body has to say is short, and says nothing of steps, rows and schemes."""
    tree = ast.parse(MODULES["shellmb.model.body"].read_text())
    (body,) = (n for n in tree.body if isinstance(n, ast.ClassDef) and n.name == "Body")
    methods = {n.name: n for n in body.body if isinstance(n, ast.FunctionDef)}
    assert len(methods) <= 8
    of_time = {"Interval", "VelocityJump", "Path", "Rows", "Step", "SubInterval", "Term"}
    for name, method in methods.items():
        named = {n.id for n in ast.walk(method) if isinstance(n, ast.Name)}
        assert not named & of_time, name


def test_schemes_answer_for_themselves() -> None:
    """Nobody asks of what class a scheme is, or takes what is missing for a kind of scheme."""
    schemes = {
        node.name
        for module in MODULES
        if module.startswith("shellmb.schemes.")
        for node in parsed(module)
        if isinstance(node, ast.ClassDef)
    }
    for module in MODULES:
        for node in parsed(module):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
                asked = {n.id for n in ast.walk(node.args[1]) if isinstance(n, ast.Name)}
                assert not asked & schemes, f"{module}, line {node.lineno}"
            if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.Is | ast.IsNot):
                looked_at = {getattr(n, "attr", getattr(n, "id", "")) for n in ast.walk(node.left)}
                assert not looked_at & {"push", "scaled"}, f"{module}, line {node.lineno}"


def test_no_circles() -> None:
    arrows = {m: {n for n in imports(m) if n in MODULES and n != m} for m in MODULES}
    # raises CycleError, which names the modules
    assert set(TopologicalSorter(arrows).static_order()) == set(MODULES)


def test_small_rooms() -> None:
    folders = Counter(str(path.parent.relative_to(ROOT)) for path in MODULES.values())
    assert not {name: n for name, n in folders.items() if n > MAX_MODULES and name not in NO_ROOM}


def test_contributing_lists_the_rooms() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text()
    for name, path in MODULES.items():
        if path.name == "__init__.py" and name not in ("shellmb", "shellmb.demos"):
            said = (ast.get_docstring(ast.parse(path.read_text())) or "").splitlines()[0]
            room = name.removeprefix("shellmb.").replace(".", "/")
            assert f"- `{room}`: {said.rstrip('.')}\n" in text


def test_the_walks_through_the_code_are_true() -> None:
    """Each line of CONTRIBUTING.md names a file, and a class or function that stands there."""
    lines = re.findall(
        r"^- `([\w/]+\.py)`, `(\w+)`: ", (ROOT / "CONTRIBUTING.md").read_text(), re.M
    )
    assert len(lines) >= 20
    for file, name in lines:
        defined = re.search(
            rf"^ *(?:class|def) {name}\b", (ROOT / "shellmb" / file).read_text(), re.M
        )
        assert defined, f"{name} is not in {file}"


def test_files_that_texts_name_are_there() -> None:
    named = re.compile(r"(?<![\w./-])(?:shellmb|forms|tests|demos)/[\w/.-]*\w")
    texts = [*MODULES.values(), *ROOT.glob("*.md"), *(ROOT / "docs").glob("*/*.md")]
    gone = {
        (str(path.relative_to(ROOT)), name)
        for path in texts
        for name in named.findall(path.read_text())
        if not (ROOT / name).exists()
    }
    assert not gone


def test_small_files() -> None:
    paths = [*MODULES.values(), *(ROOT / "tests").rglob("*.py")]
    lengths = {str(p.relative_to(ROOT)): len(p.read_text().splitlines()) for p in paths}
    assert not {name: n for name, n in lengths.items() if n > MAX_LINES}


def test_the_code_does_not_grow() -> None:
    """`MOST_LINES` is a ratchet: it never rises, and follows what is taken away."""
    lines = {language: rooms.total() for language, rooms in counted().items()}
    assert lines.keys() == MOST_LINES.keys()
    for language, most in MOST_LINES.items():
        now = lines[language]
        assert now <= most, f"{now} lines of {language}, {most} are the most (tests/size.py)"
        assert now > most - LESS, f"{now} lines of {language}: set MOST_LINES to it, it is {most}"
