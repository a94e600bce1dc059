// How pipelines come to be: from nothing, from caches, from one another, on threads.
#include <fmt/format.h>

#include <bit>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include "common/error.h"
#include "vulkan/bench/families.h"
#include "vulkan/framework/spirv_optimizer.h"
#include "vulkan/renderer/kernels/constant_ids.h"

namespace tandem {

namespace {

enum class Making { cold, trimmed, cache, disk, derived, threads };

using Constants = std::vector<SpecialisationConstant>;

// Drivers keep what they compiled, over processes too. A pipeline is new to them if no other had its constants. So the
// greatest distance of rays shrinks by an ulp each time, from anywhere between all and half of it.
class NewConstants {
public:
    explicit NewConstants(Constants constants) : constants_(std::move(constants)) {
        constexpr std::uint32_t ulps = 1u << 23;
        next_ = std::bit_cast<std::uint32_t>(std::numeric_limits<float>::max()) - std::random_device()() % ulps;
    }
    [[nodiscard]] const Constants& next() {
        for (SpecialisationConstant& constant : constants_)
            if (constant.id == static_cast<std::uint32_t>(ConstantId::ray_max)) constant.value = next_;
        --next_;
        return constants_;
    }

private:
    Constants constants_;
    std::uint32_t next_;
};

// A file that goes with its owner.
class CacheFile {
public:
    CacheFile()
        : path_(std::filesystem::temp_directory_path() / fmt::format("tandem-pipelines-{}", std::random_device()())) {}
    ~CacheFile() {
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    CacheFile(const CacheFile&) = delete;
    CacheFile& operator=(const CacheFile&) = delete;

    void write(const std::vector<std::uint8_t>& data) const {
        std::ofstream file(path_, std::ios::binary);
        file.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
        if (!file) throw Error("cannot write " + path_.string());
    }
    [[nodiscard]] std::vector<char> read() const {
        std::ifstream file(path_, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }

private:
    std::filesystem::path path_;
};

class PipelinesRun : public ArmRun {
public:
    PipelinesRun(SharedDevice device, std::vector<Stage> kernels, Making making)
        : device_(std::move(device)),
          kernels_(std::move(kernels)),
          making_(making),
          known_(device_->specialisation().constants()),
          new_(known_) {
        for (const Stage kernel : kernels_) codes_.emplace(kernel, device_->code(kernel));
        if (making == Making::cache || making == Making::disk) {
            cache_ = vk::raii::PipelineCache(device_->device().handle(), vk::PipelineCacheCreateInfo());
            for (const Stage kernel : kernels_) (void)make(kernel, known_, cache_);
            file_.write(cache_.getData());
        }
        if (making == Making::derived)
            for (const Stage kernel : kernels_)
                bases_.push_back(make(kernel, known_, nullptr, vk::PipelineCreateFlagBits::eAllowDerivatives));
    }

    [[nodiscard]] ClockReadings run() override {
        const Constants& constants = new_.next();
        const double start = steady_seconds();
        std::vector<vk::raii::Pipeline> made;
        switch (making_) {
            case Making::cold:
                for (const Stage kernel : kernels_) made.push_back(make(kernel, constants, nullptr));
                break;
            case Making::trimmed:
                for (const Stage kernel : kernels_)
                    made.push_back(make_compute_pipeline(device_->device(), nullptr, device_->layout(),
                        trimmed_spirv(codes_.at(kernel), constants), constants));
                break;
            case Making::cache:
                for (const Stage kernel : kernels_) made.push_back(make(kernel, known_, cache_));
                break;
            case Making::disk: {
                const std::vector<char> data = file_.read();
                const vk::raii::PipelineCache cache(
                    device_->device().handle(), vk::PipelineCacheCreateInfo({}, data.size(), data.data()));
                for (const Stage kernel : kernels_) made.push_back(make(kernel, known_, cache));
                break;
            }
            case Making::derived:
                for (std::size_t i = 0; i < kernels_.size(); ++i)
                    made.push_back(
                        make(kernels_[i], constants, nullptr, vk::PipelineCreateFlagBits::eDerivative, *bases_[i]));
                break;
            case Making::threads:
                made = make_on_threads(constants);
                break;
        }
        return {{"total", steady_seconds() - start}};
    }

private:
    [[nodiscard]] vk::raii::Pipeline make(Stage kernel, const Constants& constants,
        const vk::raii::PipelineCache& cache, vk::PipelineCreateFlags flags = {}, vk::Pipeline base = {}) const {
        return make_compute_pipeline(
            device_->device(), cache, device_->layout(), codes_.at(kernel), constants, flags, base);
    }

    [[nodiscard]] std::vector<vk::raii::Pipeline> make_on_threads(const Constants& constants) const {
        std::vector<vk::raii::Pipeline> made;
        std::vector<std::exception_ptr> failures(kernels_.size());
        for (std::size_t i = 0; i < kernels_.size(); ++i) made.emplace_back(nullptr);
        {
            std::vector<std::jthread> threads;
            for (std::size_t i = 0; i < kernels_.size(); ++i)
                threads.emplace_back([&, i] {
                    try {
                        made[i] = make(kernels_[i], constants, nullptr);
                    } catch (...) {
                        failures[i] = std::current_exception();
                    }
                });
        }
        for (const std::exception_ptr& failure : failures)
            if (failure) std::rethrow_exception(failure);
        return made;
    }

    SharedDevice device_;
    std::vector<Stage> kernels_;
    std::map<Stage, std::vector<std::uint32_t>> codes_;
    Making making_;
    Constants known_;
    NewConstants new_;
    CacheFile file_;
    vk::raii::PipelineCache cache_ = nullptr;
    std::vector<vk::raii::Pipeline> bases_;
};

}  // namespace

Family pipelines_family(const SharedDevice& device) {
    Family family;
    family.name = "pipelines";
    family.question = "How should pipelines be made?";
    family.hypothesis = "A cache halves the time; threads share it out; so does trimming";
    family.source = "Khronos samples: pipeline_cache (50.4 against 24.4 ms)";
    family.held =
        "the code of the kernels and all constants but the greatest ray distance, new each time unless cached";
    family.base =
        "the pipelines of the workload's kernels made one after the other; the total lasts over their creation alone";
    family.along = "kernels";
    const std::vector<Stage> few{Stage::pre_process, Stage::ray_gen, Stage::post_process};
    family.workloads.push_back({"three small kernels", {{"kernels", 3.0}}});
    // The kernel that shades takes too long for so many replicates.
    family.workloads.push_back({"the same and intersection", {{"kernels", 4.0}}});
    family.arms = [device, few](const Workload& workload) {
        std::vector<Stage> kernels = few;
        if (workload.factors.at("kernels") > 3.0) kernels.push_back(Stage::intersect);
        const auto arm = [&](const char* name, const char* text, Making making) {
            return Arm{name, text, [=] { return std::make_unique<PipelinesRun>(device, kernels, making); }};
        };
        return std::vector<Arm>{arm("cold", "new to the driver, no cache, one after the other", Making::cold),
            arm("trimmed", "new to the driver; spirv-opt has specialised the code before and taken out what is dead",
                Making::trimmed),
            arm("cache", "made before with a VkPipelineCache, which is at hand", Making::cache),
            arm("disk", "the same, the cache's data read from a file", Making::disk),
            arm("derived", "new to the driver, derived from a pipeline that differs in a constant", Making::derived),
            arm("threads", "new to the driver, a thread for each kernel", Making::threads)};
    };
    return family;
}

}  // namespace tandem
