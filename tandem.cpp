// Wires the rooms together: the backends, the devices, and the commands that work on them.
#include "common/commands/command.h"
#include "cpu_ref/backend.h"
#include "cpu_ref/exercises/exercises.h"
#include "vulkan/backend.h"
#include "vulkan/bench/bench.h"
#include "vulkan/devices.h"
#include "vulkan/framework/list_shader.h"
#ifdef TANDEM_WINDOW
#include "vulkan/window/view_window.h"
#include "vulkan/window/window_place.h"
#endif

int main(int argc, char** argv) {
    const tandem::Program program{
        .backends = {tandem::cpu_backend(), tandem::vulkan_backend(), tandem::oracle_backend(),
            tandem::first_backend()},
        .devices = tandem::devices_as_json,
#ifdef TANDEM_WINDOW
        .bench =
            [](const tandem::BenchRequest& request) {
                return tandem::vulkan_bench(request, tandem::make_window_place);
            },
        .show = tandem::show_in_window,
#else
        .bench = [](const tandem::BenchRequest& request) { return tandem::vulkan_bench(request); },
        .show = {},
#endif
        .claims = tandem::pattern_claims,
        .exercises = tandem::exercises(),
        .run_list_shader = tandem::run_list_shader,
    };
    return tandem::run_program(argc, argv, program);
}
