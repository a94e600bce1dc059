// Renders a scene under Vulkan's validation layer, in a separate process, so that no verdict is lost if the layer
// aborts. The layer's messages are reported beside the verdict on the images.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

namespace tandem {

struct LayerPass {
    enum class Outcome { not_run, clean, messages, too_slow };
    Outcome outcome = Outcome::not_run;
    std::string text;  // the messages, a line each, or why it was not run
};
[[nodiscard]] const char* name_of(LayerPass::Outcome outcome);

// Renders two samples of a small image of the scene with the candidate of `options`, words of `tandem render`. Too
// slow: it had no sample of every pixel after `seconds`, or was stopped.
[[nodiscard]] LayerPass look_under_layer(
    const std::string& scene, const std::vector<std::string>& options, double seconds, const std::stop_token& stop);

// What the exit status and the error output of such a process mean.
[[nodiscard]] LayerPass layer_pass_from(int status, const std::string& errors);

}  // namespace tandem
