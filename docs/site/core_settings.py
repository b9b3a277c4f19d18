"""Show the settings that the core declares, and names that packages load when they are used."""

import importlib

import griffe

import sdnn.config


class CoreSettings(griffe.Extension):
    """Give the classes of `sdnn.config` their parameters, and lazy packages their ``__all__``."""

    def on_module_members(self, *, mod, **kwargs):
        """Note the public names of a package whose list is made when it is imported."""
        if "attach" in mod.imports:
            mod.exports = importlib.import_module(mod.path).__all__

    def on_class(self, *, cls, **kwargs):
        """Add the constructor's parameters to a class of the core that has fields."""
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
