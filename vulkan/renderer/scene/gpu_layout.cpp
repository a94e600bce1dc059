// Compiles the static_asserts that shaders/tools/check_layouts.py reads out of the SPIR-V.
#include "layout_checks.h"
