#include "vulkan/window/panel.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <numbers>

#include "common/error.h"
#include "common/view/camera_control.h"

namespace tandem {

namespace {

constexpr const char* help_text =
    "left drag: turn about the target\n"
    "right drag: look around\n"
    "middle drag: shift\n"
    "wheel: nearer, farther\n"
    "W A S D Q E: fly\n"
    "R: first view    P: next present mode\n"
    "F2: save    F11: full screen\n"
    "H: hide this panel    Esc: quit";

vk::raii::DescriptorPool make_pool(const Device& device) {
    const vk::DescriptorPoolSize one(vk::DescriptorType::eCombinedImageSampler, 1);  // the font's
    return {
        device.handle(), vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, one)};
}

// The device's work that runs once, before the first frame.
void run_once(const Device& device, const std::function<void(vk::CommandBuffer)>& record) {
    const vk::raii::CommandPool pool(device.handle(), vk::CommandPoolCreateInfo({}, device.queue_family()));
    const vk::raii::CommandBuffers buffers(
        device.handle(), vk::CommandBufferAllocateInfo(*pool, vk::CommandBufferLevel::ePrimary, 1));
    buffers.front().begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    record(*buffers.front());
    buffers.front().end();
    device.queue().submit(vk::SubmitInfo({}, {}, *buffers.front()));
    device.queue().waitIdle();
}

void check(VkResult result) {
    if (result < 0) throw Error("the panel cannot be drawn: " + vk::to_string(static_cast<vk::Result>(result)));
}

}  // namespace

Panel::Panel(const Instance& instance, const Device& device, GlfwWindow& window, Presenter& presenter)
    : window_(window), presenter_(presenter), descriptors_(make_pool(device)) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // no file that nobody asked for
    ImGui::StyleColorsDark();
    ImGui_ImplGlfw_InitForVulkan(window.handle(), true);
    ImGui_ImplVulkan_InitInfo info{};
    info.Instance = *instance.handle();
    info.PhysicalDevice = *device.physical();
    info.Device = *device.handle();
    info.QueueFamily = device.queue_family();
    info.Queue = *device.queue();
    info.DescriptorPool = *descriptors_;
    info.MinImageCount = presenter.swapchain().least_images();
    info.ImageCount = static_cast<std::uint32_t>(presenter.swapchain().image_count());
    info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
    info.CheckVkResultFn = check;
    ImGui_ImplVulkan_Init(&info, presenter.render_pass());
    run_once(device, [](vk::CommandBuffer commands) { ImGui_ImplVulkan_CreateFontsTexture(commands); });
    ImGui_ImplVulkan_DestroyFontUploadObjects();
}

Panel::~Panel() {
    presenter_.wait();
    ImGui_ImplVulkan_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

void Panel::save(const WindowOptions& options) {
    if (!options.save) return;
    try {
        message_ = options.save(appearance_);
    } catch (const Error& failure) {
        message_ = failure.what();
    }
}

void Panel::take_keys(ViewSession& session, const WindowOptions& options) {
    const std::vector<int> pressed = window_.take_pressed();
    if (ImGui::GetIO().WantTextInput) return;
    const auto was = [&](int key) { return std::ranges::find(pressed, key) != pressed.end(); };
    if (was(GLFW_KEY_ESCAPE)) window_.close();
    if (was(GLFW_KEY_H)) visible_ = !visible_;
    if (was(GLFW_KEY_R)) session.reset_camera();
    if (was(GLFW_KEY_P)) next_mode();
    if (was(GLFW_KEY_F2)) save(options);
    if (was(GLFW_KEY_F11)) window_.set_full_screen(!window_.full_screen());
}

void Panel::move_camera(ViewSession& session) {
    const ImGuiIO& io = ImGui::GetIO();
    Camera camera = session.camera();
    bool moves = false;
    if (!io.WantCaptureMouse) {
        // A drag across the window's height is half a turn.
        const double scale = std::numbers::pi / std::max(io.DisplaySize.y, 1.0f);
        const double x = io.MouseDelta.x * scale, y = io.MouseDelta.y * scale;
        const bool dragged = x != 0.0 || y != 0.0;
        if (dragged && io.MouseDown[ImGuiMouseButton_Left]) camera = orbited(camera, x, y);
        if (dragged && io.MouseDown[ImGuiMouseButton_Right]) camera = turned(camera, x, -y);
        if (dragged && io.MouseDown[ImGuiMouseButton_Middle]) camera = moved(camera, {-x, y, 0.0});
        moves = dragged && (io.MouseDown[0] || io.MouseDown[1] || io.MouseDown[2]);
        if (io.MouseWheel != 0.0f) {
            camera = approached(camera, std::pow(0.9, static_cast<double>(io.MouseWheel)));
            moves = true;
        }
    }
    if (!io.WantTextInput) {
        const auto axis = [&](int forth, int back) {
            return static_cast<double>(window_.key(forth)) - static_cast<double>(window_.key(back));
        };
        const glm::dvec3 way{axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q), axis(GLFW_KEY_W, GLFW_KEY_S)};
        if (way != glm::dvec3(0.0)) {
            camera = moved(camera, static_cast<double>(io.DeltaTime) * way);  // a distance to the target a second
            moves = true;
        }
    }
    if (moves) session.set_camera(camera);
}

void Panel::show_backends(const ViewSession& session) const {
    for (std::size_t i = 0; i < session.view_count(); ++i) {
        const ViewState state = session.view(i).state();
        const std::string text =
            state.failure.empty() ? fmt::format("{} samples, {:.1f} s", state.samples, state.seconds) : state.failure;
        ImGui::TextWrapped("%s: %s", session.view(i).info().backend.c_str(), text.c_str());
    }
}

void Panel::next_mode() {
    constexpr std::size_t count = present_mode_names.size();
    auto mode = static_cast<std::size_t>(presenter_.mode());
    do mode = (mode + 1) % count;
    while (!presenter_.abilities().has(static_cast<PresentMode>(mode)));
    presenter_.set_mode(static_cast<PresentMode>(mode));
}

void Panel::show_presentation() {
    const PresentMode mode = presenter_.mode();
    const std::string shown(present_mode_names[static_cast<std::size_t>(mode)]);
    if (!ImGui::BeginCombo("present mode", shown.c_str())) return;
    for (std::size_t i = 0; i < present_mode_names.size(); ++i) {
        const auto other = static_cast<PresentMode>(i);
        if (!presenter_.abilities().has(other)) continue;
        if (ImGui::Selectable(std::string(present_mode_names[i]).c_str(), other == mode)) presenter_.set_mode(other);
    }
    ImGui::EndCombo();
}

void Panel::show(ViewSession& session, const WindowOptions& options, double seconds_a_frame) {
    ImGui::SetNextWindowPos({8.0f, 8.0f}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowBgAlpha(0.75f);
    ImGui::Begin("Tandem", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
    ImGui::PushTextWrapPos(340.0f);
    show_backends(session);
    ImGui::Text("%u x %u, %.0f frames a second", session.width(), session.height(),
        seconds_a_frame > 0.0 ? 1.0 / seconds_a_frame : 0.0);
    ImGui::PopTextWrapPos();
    auto stops = static_cast<float>(std::log2(appearance_.exposure));
    if (ImGui::SliderFloat("exposure, stops", &stops, -8.0f, 8.0f, "%.1f"))
        appearance_.exposure = std::exp2(static_cast<double>(stops));
    if (session.view_count() > 1) {
        auto split = static_cast<float>(appearance_.split);
        if (ImGui::SliderFloat("split", &split, 0.0f, 1.0f, "%.2f")) appearance_.split = static_cast<double>(split);
    }
    show_presentation();
    if (ImGui::Checkbox("render at the window's size", &fits_window_) && !fits_window_) {
        const Film& film = session.first_film();
        session.set_size(film.width, film.height);
    }
    if (ImGui::Button("Save (F2)")) save(options);
    if (!message_.empty()) {
        ImGui::PushTextWrapPos(340.0f);
        ImGui::TextUnformatted(message_.c_str());
        ImGui::PopTextWrapPos();
    }
    if (ImGui::CollapsingHeader("mouse and keys")) ImGui::TextUnformatted(help_text);
    ImGui::End();
}

void Panel::update(ViewSession& session, const WindowOptions& options, double seconds_a_frame) {
    ImGui_ImplVulkan_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    take_keys(session, options);
    move_camera(session);
    if (visible_) show(session, options, seconds_a_frame);
    if (const vk::Extent2D size = window_.size(); fits_window_ && size.width > 0 && size.height > 0)
        session.set_size(size.width, size.height);
    ImGui::Render();
}

void Panel::draw(vk::CommandBuffer commands) { ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), commands); }

}  // namespace tandem
