#include "cpu_ref/backend.h"
