"""Notice at the top of every generated file."""

NOTICE = "Generated from the declarations in simplemsg/ by `make reference`; do not edit."
