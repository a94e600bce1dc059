// The processes of mpirun. They are one renderer, in which rank 0 gives out blocks of samples, or workers for rank 0.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "common/distribution/mpi/module.h"
#include "common/render/renderer.h"

namespace tandem {

// Whether mpirun started more than one process of this.
[[nodiscard]] bool has_ranks();

class Ranks {
public:
    // Throws Error where has_ranks() but MPI cannot be had. Processes that this one starts from now on are no ranks.
    Ranks();
    ~Ranks();  // rank 0 ends the others
    Ranks(const Ranks&) = delete;
    Ranks& operator=(const Ranks&) = delete;

    [[nodiscard]] int rank() const { return rank_; }
    [[nodiscard]] int size() const { return size_; }

    // Rank 0: `own` and all the others', as one. Each other rank must have called serve() with the same `task`, else
    // InputError.
    [[nodiscard]] std::unique_ptr<Renderer> all(
        std::unique_ptr<Renderer> own, const std::string& task, const std::function<void(const std::string&)>& told);

    // Others: renders for rank 0 until that ends. `task` says of what.
    void serve(RenderJob& job, const RendererInfo& info, const std::string& task, const std::stop_token& stop);

    // Rank 0: waits for all others, which must have called answer() with the same `task`, else InputError.
    void greet(const std::string& task);
    // Rank 0: asks one of the others, which must have nothing in hand.
    void ask(int other, const std::string& request);
    // Rank 0: what that rank answered, once it has. Throws Error where it could not.
    [[nodiscard]] std::optional<std::string> answer_of(int other);
    // Others: answers rank 0 until that ends.
    void answer(const std::string& task, const std::function<std::string(const std::string&)>& work);

    // Others, in place of serve(): tells rank 0 why they cannot.
    void fail(const std::string& reason);

private:
    friend class RankJob;
    void send(int to, const std::string& message);
    // A message of that rank, if there is one.
    [[nodiscard]] bool receive(int from, std::string& message);
    [[nodiscard]] std::string wait_for(int from, double seconds);

    const MpiModule* module_ = nullptr;
    std::mutex lock_;
    int rank_ = 0, size_ = 1;
};

}  // namespace tandem
