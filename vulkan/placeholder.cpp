#include "vulkan/backend.h"
