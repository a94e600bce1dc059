// One operation on given numbers, for the self-test of a device's arithmetic (common/self_test). It is compiled without
// exact_arithmetic.py, as the test includes what a compiler does to code that is not `precise`.
#version 460
layout(local_size_x = 64) in;

struct Task {
    vec3 arguments;
    uint operation;  // common/self_test/arithmetic_probe.h
};
layout(std430, set = 0, binding = 0) readonly buffer Tasks { Task tasks[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Results { float results[]; };
layout(push_constant) uniform Counts { uint count; };

float multiply_add(float x, float y, float z) { return x * y + z; }
float precise_multiply_add(float x, float y, float z) {
    precise float result = x * y + z;
    return result;
}
float add_subtract(float x, float y) { return (x + y) - x; }
float precise_add_subtract(float x, float y) {
    precise float result = (x + y) - x;
    return result;
}

float computed(uint operation, float x, float y, float z) {
    switch (operation) {
        case 0: return x + y;
        case 1: return x - y;
        case 2: return x * y;
        case 3: return x / y;
        case 4: return fma(x, y, z);
        case 5: return sqrt(x);
        case 6: return inversesqrt(x);
        case 7: return sin(x);
        case 8: return cos(x);
        case 9: return exp(x);
        case 10: return log(x);
        case 11: return pow(x, y);
        case 12: return atan(x);
        case 13: return min(x, y);
        case 14: return max(x, y);
        case 15: return x < y ? 1.0 : 0.0;
        case 16: return multiply_add(x, y, z);
        case 17: return precise_multiply_add(x, y, z);
        case 18: return add_subtract(x, y);
        case 19: return precise_add_subtract(x, y);
    }
    return 0.0;
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    const Task task = tasks[i];
    results[i] = computed(task.operation, task.arguments.x, task.arguments.y, task.arguments.z);
}
