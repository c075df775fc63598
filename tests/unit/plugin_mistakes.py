"""Plugins with one mistake each, as files that are imported like installed ones."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from types import SimpleNamespace

HEAD = "from lsds.contracts import BackendSpec\nfrom lsds.registry import hookimpl\n"
GOOD_SPEC = 'BackendSpec("gripper", "bad", "fake_cell:FakeGripper", "fake_cell:Options")'


def hook(body: str) -> str:
    """Return the source of a manifest whose hook has this body."""
    return f"{HEAD}\n@hookimpl\ndef lsds_backends():\n    {body}\n"


def offering(*fields: str) -> str:
    """Return the source of a manifest that offers a backend with these fields."""
    given = ", ".join(fields)
    return hook(f"return [BackendSpec(**dict(dict(kind='gripper', name='bad', factory='m:a'), {given}))]")


REFUSED: dict[str, tuple[str, str, str]] = {
    # -- the manifest cannot be imported
    "raises ImportError": ("raise ImportError('libacme.so')", "ImportError: libacme.so", "pip install -U bad-dist"),
    "imports what is not there": ("import a_module_nobody_has", "ModuleNotFoundError", "LSDS_BLOCK_PLUGINS=bad"),
    "has a syntax error": ("def (:", "SyntaxError", "pip install -U bad-dist"),
    "exits": ("import sys; sys.exit(3)", "SystemExit: 3", "LSDS_BLOCK_PLUGINS=bad"),
    "raises a BaseException": ("class Own(BaseException): ...\nraise Own('x')", "Own: x", "LSDS_BLOCK_PLUGINS=bad"),
    "raises GeneratorExit": ("raise GeneratorExit", "GeneratorExit", "LSDS_BLOCK_PLUGINS=bad"),
    "recurses endlessly": ("def f(): f()\nf()", "RecursionError", "LSDS_BLOCK_PLUGINS=bad"),
    "raises a text of many lines": ("raise ValueError('one\\ntwo\\nthree')", "ValueError: one two three", "upgrade it"),
    "raises an error without text": (
        "class E(Exception):\n    def __str__(self): raise KeyError\nraise E",
        "E: (no text)",
        "upgrade it",
    ),
    "raises a group": ("raise ExceptionGroup('g', [ValueError('v')])", "ExceptionGroup: g", "upgrade it"),
    "leaves warnings as errors": (
        "import warnings\nwarnings.simplefilter('error')\nwarnings.warn('old')",
        "UserWarning: old",
        "upgrade it",
    ),
    "names a field of a later lsds": (
        offering("zeal=3"),
        "unexpected keyword argument 'zeal'",
        "upgrade lsds (pip install -U lsds-tactile)",
    ),
    # -- the hook is wrong
    "has no hook": ("x = 1", "it has no hook", "define @hookimpl def lsds_backends()"),
    "forgets the decorator": (
        "def lsds_backends():\n    return []",
        "lsds_backends is not marked as a hook",
        "write @hookimpl above def lsds_backends()",
    ),
    "misspells the hook": (
        f"{HEAD}@hookimpl\ndef lsds_backend():\n    return []",
        "unknown hook 'lsds_backend'",
        "did you mean 'lsds_backends'?",
    ),
    "misspells the hook and forgets the decorator": (
        "def lsds_backens():\n    return []",
        "'lsds_backens' is not a hook",
        "did you mean 'lsds_backends'?",
    ),
    "asks for an argument": (
        f"{HEAD}@hookimpl\ndef lsds_backends(config):\n    return []",
        "config",
        "without parameters",
    ),
    "hook raises": (hook("raise RuntimeError('boom')"), "RuntimeError: boom", "pip install -U bad-dist"),
    "hook exits": (hook("raise SystemExit"), "SystemExit", "LSDS_BLOCK_PLUGINS=bad"),
    "hook returns nothing": (hook("pass"), "returned NoneType", "write return [BackendSpec(...)]"),
    "hook returns a dict": (hook("return {}"), "returned dict", "write return [BackendSpec(...)]"),
    "hook is a generator": (hook(f"yield {GOOD_SPEC}"), "returned generator", "write return [BackendSpec(...)]"),
    "hook is async": (
        hook("return []").replace("def lsds", "async def lsds"),
        "returned coroutine",
        "write return [BackendSpec(...)]",
    ),
    "hook returns a spec": (hook(f"return {GOOD_SPEC}"), "returned BackendSpec", "write return [BackendSpec(...)]"),
    "hook returns texts": (hook("return ['m:a']"), "a list with str in it", "write BackendSpec(kind, name, factory)"),
    "hook returns the class": (hook("return [BackendSpec]"), "a list with type in it", "write BackendSpec(kind"),
    # -- a field is wrong
    "unknown kind": (offering("kind='griper'"), "unknown kind 'griper'", "did you mean 'gripper'?"),
    "kind is no text": (offering("kind=3"), "kind is 3, not a text", 'write kind="..."'),
    "name with a space": (offering("name='a b'"), "backend name 'a b' is not allowed", "use letters"),
    "empty name": (offering("name=''"), "backend name '' is not allowed", "use letters"),
    "name with a colon": (offering("name='a:b'"), "backend name 'a:b' is not allowed", "use letters"),
    "reserved name": (offering("name='none'"), "backend name 'none' is not allowed", "none of 'backend'"),
    "name is no text": (offering("name=None"), "name is None, not a text", 'write name="..."'),
    "factory without attribute": (offering("factory='m'"), "factory 'm' is not of the form", "module:Name"),
    "factory with an empty part": (offering("factory='m..n:a'"), "is not of the form", "module:Name"),
    "factory is a class": (offering("factory=int"), "factory is <class 'int'>, not a text", "module:Name"),
    "options is a class": (offering("options=dict"), "options <class 'dict'> is not of the form", "module:Name"),
    "summary is no text": (offering("summary=['a']"), "summary is ['a'], not a text", 'write summary="..."'),
    "extra is no text": (offering("extra=None"), "extra is None, not a text", 'write extra="..."'),
    "requires is a text": (offering("requires='numpy'"), "requires is a text", 'write requires=("numpy",)'),
    "requires holds no texts": (offering("requires=(3,)"), "requires is (3,), not a tuple", 'requires=("numpy",)'),
    "a flag is a text": (offering("virtual_time='no'"), "virtual_time is 'no'", "write virtual_time=True"),
    "newer contract": (
        offering("contract=99"),
        "needs lsds with contract 99; this one has 2",
        "upgrade lsds: pip install -U lsds-tactile",
    ),
    "older contract": (offering("contract=0"), "written for contract 0; this lsds supports 1", "upgrade the plugin"),
    "contract is no number": (offering("contract='1'"), "contract is '1', not a whole number", "write contract=2"),
    "claims a name twice": (
        hook(f"return [{GOOD_SPEC}, {GOOD_SPEC}]"),
        "gripper 'bad' is offered twice",
        "its own name",
    ),
}
"""Mistakes for which a plugin is refused: the manifest, a part of the problem, a part of the remedy."""

TOLERATED: dict[str, str] = {
    "prints": hook(f"print('noise'); return [{GOOD_SPEC}]"),
    "changes the folder": f"import os\nos.chdir('/')\n{hook(f'return [{GOOD_SPEC}]')}",
    "replaces stdout": f"import io, sys\nsys.stdout = io.StringIO()\n{hook(f'return [{GOOD_SPEC}]')}",
    "closes stdout": f"import sys\nsys.stdout.close()\n{hook(f'return [{GOOD_SPEC}]')}",
    "removes stderr": f"import sys\nsys.stderr = None\n{hook(f'return [{GOOD_SPEC}]')}",
    "turns warnings into errors": f"import warnings\nwarnings.simplefilter('error')\n{hook(f'return [{GOOD_SPEC}]')}",
    "warns": f"import warnings\nwarnings.simplefilter('ignore')\nwarnings.warn('x')\n{hook(f'return [{GOOD_SPEC}]')}",
    "leaves a thread running": "import threading\nstop = threading.Event()\n"
    f"threading.Thread(target=stop.wait, daemon=True).start()\n{hook(f'return [{GOOD_SPEC}]')}",
    "lists what it requires": hook(f"return [{GOOD_SPEC[:-1]}, requires=['json'])]"),
    "has attributes that raise": f"def __getattr__(name):\n    raise KeyError(name)\n{hook(f'return [{GOOD_SPEC}]')}",
}
"""Manifests with bad manners that load all the same."""

BUILT: dict[str, tuple[str, str, str]] = {
    "factory module cannot be imported": ("raise OSError('no lib')", "OSError: no lib", "pip install -U bad-dist"),
    "factory module exits": ("raise SystemExit(1)", "SystemExit: 1", "pip install -U bad-dist"),
    "factory module is missing an attribute": ("x = 1", "AttributeError", "pip install -U bad-dist"),
    "factory is no function": ("Thing = 3", "TypeError", "pip install -U bad-dist"),
    "factory takes no arguments": ("def Thing(): ...", "TypeError", "pip install -U bad-dist"),
    "factory raises": ("def Thing(o, c): raise KeyError('k')", "KeyError: 'k'", "pip install -U bad-dist"),
    "factory exits": ("import sys\ndef Thing(o, c): sys.exit(2)", "SystemExit: 2", "LSDS_BLOCK_PLUGINS=bad"),
    "factory raises many lines": ("def Thing(o, c): raise ValueError('a\\nb')", "ValueError: a b", "upgrade it"),
    "factory returns nothing": ("def Thing(o, c): ...", "returned None", "return the gripper"),
    "factory is async": ("async def Thing(o, c): ...", "is async", "def instead of async def"),
    "factory returns a class": (
        "class G: ...\ndef Thing(o, c): return G",
        "returned the class G",
        "return an object of it",
    ),
    "lacks members": ("class Thing:\n    def __init__(self, o, c): ...", "read() is missing", "lsds plugins show"),
    "has async members": (
        "import fake_cell\nclass Thing(fake_cell.FakeGripper):\n    async def read(self): ...",
        "read() is async",
        "lsds plugins show",
    ),
    "has members of another arity": (
        "import fake_cell\nclass Thing(fake_cell.FakeGripper):\n    def command(self, a, b): ...",
        "command() cannot be called as (command)",
        "lsds plugins show",
    ),
    "has a member that raises": (
        "import fake_cell\nclass Thing(fake_cell.FakeGripper):\n    @property\n    def read(self): raise OSError('x')",
        "read raises OSError",
        "lsds plugins show",
    ),
    "has a member that exits": (
        "import fake_cell\nclass Thing(fake_cell.FakeGripper):\n    @property\n    def read(self): raise SystemExit",
        "read raises SystemExit",
        "lsds plugins show",
    ),
    "has a member that is no method": (
        "import fake_cell\nclass Thing(fake_cell.FakeGripper):\n    stop = 3",
        "stop is int, not a method",
        "lsds plugins show",
    ),
    "options is no model": ("class Options: ...\ndef Thing(o, c): ...", "is not a pydantic model", "BaseModel"),
    "options raises": ("def Thing(o, c): ...\nraise ValueError('v')", "ValueError: v", "pip install -U bad-dist"),
}
"""Mistakes that show when a backend is built: its module, a part of the problem, a part of the remedy."""


class Named(EntryPoint):
    """An entry point of the distribution bad-dist."""

    @property
    def dist(self):
        return SimpleNamespace(name="bad-dist")
