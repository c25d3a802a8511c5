"""Mutants: whether the tests see it when one place of the package is made wrong.

``python benchmarks/mutants.py hand OUT`` makes the mutants of ``mutants.yaml``, one after the
other, ``... drawn OUT --count 150 --seed 46`` such that are drawn at random. Of each, those tests
run that are named for it, then those of its module, those that name what it is in, those of its
room, and those of the whole tree, until one fails. The results are lines of a file in ``OUT``,
whose mutants are not made again. ``--tests TREE`` takes all but the package of another checkout, so
that tests before and after a change are compared with the same mutants. It takes one core, and
works in a copy, ``OUT/tree``.
"""

import argparse
import ast
import itertools
import json
import os
import random
import re
import resource
import shutil
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import Phase, settings

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "tri_glide_kinematics"
# Only real processes run most of what is in these rooms.
NODE_ROOMS = ("demo", "nodes", "panel", "ros")
# Imported once, as that takes longer than most tests.
LIBRARIES = ("scipy.optimize", "scipy.signal", "ruckig", "matplotlib.pyplot", "rclpy.node", "viser")
TIMES = itertools.count(1)
# An endless loop that keeps what it makes would take all of the computer [bytes].
MEMORY = 4 << 30
# A test may wait for as long as this, and take so much of the processor [s].
WAITING, LONGEST_TEST = 900, 60.0
# For each operator what may stand there by mistake.
OTHERS: dict[str, tuple[type[Any], ...]] = {
    "Lt": (ast.LtE, ast.GtE),
    "LtE": (ast.Lt, ast.Gt),
    "Gt": (ast.GtE, ast.LtE),
    "GtE": (ast.Gt, ast.Lt),
    **{"Eq": (ast.NotEq,), "NotEq": (ast.Eq,), "Is": (ast.IsNot,), "IsNot": (ast.Is,)},
    **{"In": (ast.NotIn,), "NotIn": (ast.In,), "And": (ast.Or,), "Or": (ast.And,)},
    **{"Add": (ast.Sub,), "Sub": (ast.Add,), "Mult": (ast.Div,), "Div": (ast.Mult,)},
}


@dataclass(frozen=True)
class Mutant:
    """One wrong place: ``old`` at character ``at`` of a file of the package becomes ``new``."""

    name: str
    file: str
    at: int
    old: str
    new: str
    tests: tuple[str, ...] = ()

    @property
    def line(self) -> int:
        """First line that differs."""
        same = next((i for i, (a, b) in enumerate(zip(self.old, self.new)) if a != b), 0)
        return source(self.file).count("\n", 0, self.at + same) + 1


def source(file: str) -> str:
    """Return the text of a file of the package."""
    return (ROOT / PACKAGE / file).read_text(encoding="utf-8")


def by_hand() -> Iterator[Mutant]:
    """Make the mutants of ``mutants.yaml``.

    Raises:
        ValueError: if an old text does not stand in its file exactly once.
    """
    for row in yaml.safe_load((ROOT / "benchmarks/mutants.yaml").read_text(encoding="utf-8")):
        file, old, text = row["file"], row["old"], source(row["file"])
        if text.count(old) != 1:
            raise ValueError(f"{row['why']}: old text found {text.count(old)} times, not 1")
        tests = tuple(row.get("tests", "").split())
        yield Mutant(row["why"], file, text.index(old), old, row["new"], tests)


def drawn(count: int, seed: int) -> Iterator[Mutant]:
    """Draw a line of code, each as likely, then what is wrong in it."""
    rng = random.Random(seed)
    places: dict[tuple[str, int], list[tuple[Any, str]]] = {}
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        file = path.relative_to(ROOT / PACKAGE).as_posix()
        for node, new in wrong_nodes(ast.parse(source(file))):
            places.setdefault((file, node.lineno), []).append((node, new))
    for number, (file, line) in enumerate(rng.sample(list(places), len(places))[:count]):
        node, new = rng.choice(places[file, line])
        *before, own = source(file).encode().splitlines(keepends=True)[:line]
        at = len(b"".join((*before, own[: node.col_offset])).decode())
        old = ast.get_source_segment(source(file), node) or ""
        yield Mutant(f"{seed}-{number}", file, at, old, new)


def wrong_nodes(node: ast.AST) -> Iterator[tuple[Any, str]]:
    """Find nodes and what they may become: not in type hints, nor in what only makes texts."""
    if isinstance(node, ast.JoinedStr):
        return
    yield from wrong(node)
    for name, value in ast.iter_fields(node):
        if name not in ("annotation", "returns") and not isinstance(node, ast.Raise):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from wrong_nodes(child)


def wrong(node: ast.AST) -> Iterator[tuple[Any, str]]:
    """Make one expression or statement wrong, in each way."""
    match node:
        case ast.Compare(left, [operator], [right]):
            for other in OTHERS[type(operator).__name__]:
                yield node, f"({ast.unparse(ast.Compare(left, [other()], [right]))})"
        case ast.BinOp(left, operator, right):
            for other in OTHERS.get(type(operator).__name__, ()):
                yield node, f"({ast.unparse(ast.BinOp(left, other(), right))})"
        case ast.BoolOp(operator, values):
            for other in OTHERS[type(operator).__name__]:
                yield node, f"({ast.unparse(ast.BoolOp(other(), values))})"
        case ast.UnaryOp(ast.Not() | ast.USub(), operand):
            yield node, f"({ast.unparse(operand)})"
        case ast.Constant(bool() as value):
            yield node, str(not value)
        case ast.Constant(int() as value):
            yield node, str(value + 1)
        case ast.Constant(float() as value) if value:
            yield node, repr(2.0 * value)
        case ast.Return(ast.expr() as value) if ast.unparse(value) != "None":
            yield node, "return None"
        case ast.If(test) | ast.IfExp(test) if ast.unparse(test) != "TYPE_CHECKING":
            yield from ((test, "True"), (test, "False"))
        case ast.While(test):
            yield test, "False"
        case ast.Raise() | ast.AugAssign() | ast.Break() | ast.Continue() | ast.Expr(ast.Call()):
            yield node, "pass"
        case ast.Assign([ast.Attribute()]):
            yield node, "pass"


class Watch:
    """A plugin of pytest: runs the wanted tests for some time, and keeps what failed."""

    def __init__(self, wanted: tuple[str, ...], seconds: float) -> None:
        """Run tests whose names begin as one of ``wanted``, for some ``seconds`` of processor."""
        self._wanted, self._seconds = wanted, seconds
        self.failed = ""

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Leave out what is not wanted; slow ones come last."""
        items[:] = [item for item in items if item.nodeid.startswith(self._wanted)]
        items.sort(key=lambda item: item.get_closest_marker("slow") is not None)

    def pytest_runtest_protocol(self, item: pytest.Item) -> None:
        """End when the time is over; end a process in an endless loop, or that waits for ever."""
        if sum(os.times()[:4]) > self._seconds:
            item.session.shouldstop = "the time is over"
        signal.setitimer(signal.ITIMER_PROF, LONGEST_TEST)
        signal.alarm(WAITING)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the first failure."""
        self.failed = self.failed or report.nodeid * report.failed

    pytest_collectreport = pytest_runtest_logreport


def run_tests(out: Path, wanted: tuple[str, ...], marks: str, seconds: float) -> tuple[str, float]:
    """Run tests until one fails, in a fork, which has all libraries already.

    Args:
        out: where the tree stands.
        wanted: how the names of the tests begin, with their file at least.
        marks: which of them.
        seconds: of the processor, after which no other test begins.

    Returns:
        Name of what failed, empty if nothing did, and how much of the processor it took [s].
    """
    result = out / "failed"
    result.unlink(missing_ok=True)
    if not (child := os.fork()):
        try:
            os.setsid()
            resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            for stream in (1, 2):
                os.dup2(os.open(out / "log", os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
            os.chdir(out / "tree")
            sys.path.insert(0, os.getcwd())
            os.environ["PYTHONPATH"] = f"{os.getcwd()}:{os.environ.get('PYTHONPATH', '')}"
            watch = Watch(wanted, seconds)
            files = dict.fromkeys(name.split("::")[0] for name in wanted)
            options = ["-x", "-q", "-p", "no:cacheprovider", "-m", marks]
            code = int(pytest.main([*files, *options], plugins=[watch]))
            result.write_text(watch.failed or f"pytest ended with {code}" * (code in (3, 4)))
        finally:
            os._exit(0)
    try:
        usage = os.wait4(child, 0)[2]
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
    failed = result.read_text() if result.exists() else "a test that did not end"
    return failed, usage.ru_utime + usage.ru_stime


def names_of(node: ast.stmt) -> list[str]:
    """Return what a statement at the top of a module gives a name to."""
    match node:
        case ast.FunctionDef(name) | ast.ClassDef(name):
            return [name]
        case ast.Assign(targets):
            return [each.id for each in targets if isinstance(each, ast.Name)]
        case ast.AnnAssign(ast.Name(name)):
            return [name]
    return []


def concerned(tree: Path, mutant: Mutant) -> Iterator[tuple[str, ...]]:
    """Yield tests: named for ``mutant``, of its module, that name its place, of rooms and tree."""
    module = Path("test", mutant.file)
    place = {
        name
        for node in ast.parse(source(mutant.file)).body
        if node.lineno <= mutant.line <= (node.end_lineno or 0)
        for name in names_of(node)
    }
    texts = {
        path.relative_to(tree).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted((tree / "test").rglob("test_*.py"))
        if "integration" not in path.parts
    }
    named = [name for name in mutant.tests if (tree / name.split("::")[0]).exists()]
    own = [file for file in texts if file == module.with_name(f"test_{module.name}").as_posix()]
    naming = [file for file in texts if place & set(re.findall(r"\w+", texts[file]))]
    room, *larger = [
        [file for file in texts if folder in Path(file).parents]
        for folder in [*module.parents][:-2]
    ] or [[]]
    # Of the tree as a whole: its laws, the digests of all setpoints, the documents.
    whole = [file for file in texts if Path(file).parent in (Path("test"), Path("test/docs"))]
    past: set[str] = set()
    for files in (named, own, naming, room, whole, *larger):
        if new := tuple(file for file in files if file not in past):
            yield new
        past.update(files)


def judged(out: Path, mutant: Mutant, marks: str, limit: float) -> dict[str, Any]:
    """Put ``mutant`` into the tree, and run tests until one fails."""
    changed = out / "tree" / PACKAGE / mutant.file
    original = changed.read_text(encoding="utf-8")
    write(changed, original[: mutant.at] + mutant.new + original[mutant.at + len(mutant.old) :])
    seconds, failed = 0.0, ""
    for tests in concerned(out / "tree", mutant):
        by_nodes = tests[0].startswith("test/integration")
        failed, more = run_tests(out, tests, "" if by_nodes else marks, max(limit - seconds, 1.0))
        seconds += more
        if failed or seconds > limit:
            break
    write(changed, original)
    by_nodes = mutant.file.split("/")[0] in NODE_ROOMS or "rclpy" in original
    fate = "needs nodes" if by_nodes else "survived"
    fate = "killed" if failed else "not decided in time" if seconds > limit else fate
    found = {"line": mutant.line, "fate": fate, "by": failed, "seconds": round(seconds, 1)}
    return asdict(mutant) | found


def write(file: Path, text: str) -> None:
    """Write a module with a time of its own, so that no compiled one of before is taken for it."""
    file.write_text(text, encoding="utf-8")
    os.utime(file, (time := next(TIMES), time))


def rows(file: Path) -> list[dict[str, Any]]:
    """Read lines of JSON, none if there is no file."""
    return [json.loads(line) for line in file.open(encoding="utf-8")] if file.exists() else []


def main() -> int:
    """Make mutants; return 1 if one by hand survives, or a test fails without one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("hand", "drawn"))
    parser.add_argument("out", type=Path, help="folder of the results")
    parser.add_argument("--tests", type=Path, default=ROOT, help="checkout with the tests")
    parser.add_argument("--count", type=int, default=150, help="of mutants that are drawn")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--marks", default="not nodes and not alone", help="of tests, but nodes'")
    parser.add_argument("--limit", type=float, default=120.0, help="for a mutant [s]")
    parser.add_argument("--only-survivors-of", type=Path, help="results of another run")
    options = parser.parse_args()
    out, results = options.out.resolve(), options.out / f"{options.what}.jsonl"
    mutants = [*(by_hand() if options.what == "hand" else drawn(options.count, options.seed))]
    shutil.rmtree(out / "tree", ignore_errors=True)
    left_out = shutil.ignore_patterns(".*", "__pycache__", "install", "build", "log", "out")
    shutil.copytree(options.tests, out / "tree", ignore=left_out)
    shutil.rmtree(out / "tree" / PACKAGE)
    shutil.copytree(ROOT / PACKAGE, out / "tree" / PACKAGE, ignore=left_out)
    sys.path.pop(0)
    sys.dont_write_bytecode = False
    for library in LIBRARIES:
        import_module(library)
    # What fails need not be made small.
    quick = settings(phases=(Phase.explicit, Phase.generate), database=None)
    settings.register_profile("mutants", quick)
    settings.load_profile("mutants")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    done = {row["name"] for row in rows(results)}
    if options.only_survivors_of:
        done |= {r["name"] for r in rows(options.only_survivors_of) if r["fate"] == "killed"}
    for mutant in mutants:
        if mutant.name not in done:
            row = judged(out, mutant, options.marks, options.limit)
            with results.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(row) + "\n")
            print(f"{row['fate']}: {mutant.file}:{mutant.line}: {mutant.name}", flush=True)
    fates = Counter(row["fate"] for row in rows(results))
    print(", ".join(f"{count} {fate}" for fate, count in fates.most_common()))
    killers = tuple(sorted({row["by"] for row in rows(results) if "::" in row["by"]}))
    failed = run_tests(out, killers, "", 1e4)[0] if killers else ""
    if failed:
        print(f"without a mutant, too, this fails: {failed}")
    return int(bool(failed) or (options.what == "hand" and fates["killed"] < len(mutants)))


if __name__ == "__main__":
    sys.exit(main())
