"""Show what is only known when modules run: settings of the core, lazy names, joined docstrings."""

import importlib
import inspect

import griffe

import sdnn.config


class CoreSettings(griffe.Extension):
    """Adds parameters of `sdnn.config`, ``__all__`` of lazy packages, docstrings of estimators."""

    def on_module_members(self, *, mod, **kwargs):
        """Note the public names of a package whose list is made when it is imported."""
        if "attach" in mod.imports:
            mod.exports = importlib.import_module(mod.path).__all__

    def on_class(self, *, cls, **kwargs):
        """Add parameters to classes of the core, and entries of base classes to docstrings."""
        if any(decorator.callable_path.endswith(".documents") for decorator in cls.decorators):
            estimator = getattr(importlib.import_module(cls.module.path), cls.name)
            cls.docstring = griffe.Docstring(inspect.getdoc(estimator), parent=cls)
        if not cls.path.startswith("sdnn._core."):
            return
        fields = sdnn.config.fields_of(getattr(sdnn.config, cls.name, None))
        if not fields:
            return
        keyword = griffe.ParameterKind.keyword_only
        parameters = [
            griffe.Parameter(f.name, annotation=f.hint, kind=keyword, default=repr(f.default))
            for f in fields
        ]
        self_ = griffe.Parameter("self", kind=griffe.ParameterKind.positional_or_keyword)
        cls.set_member(
            "__init__",
            griffe.Function("__init__", parameters=griffe.Parameters(self_, *parameters)),
        )
