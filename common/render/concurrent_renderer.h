// A renderer whose jobs may be prepared by several threads at once. It pays where a driver takes long to make kernels.
#pragma once

namespace tandem {

class ConcurrentRenderer {
public:
    virtual ~ConcurrentRenderer() = default;
    // As many threads may call Renderer::prepare() at once, while no job renders.
    [[nodiscard]] virtual unsigned prepares_at_once() const = 0;
};

}  // namespace tandem
