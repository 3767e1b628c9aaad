"""What every generated file says at its top."""

NOTICE = "Generated from the declarations in simplemsg/ by `make reference`; do not edit."
