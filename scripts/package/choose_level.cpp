// The installed `tandem`: becomes PREFIX/lib/tandem/LEVEL/tandem of the widest level that this processor runs. The
// levels are those of the x86-64 psABI; a processor with what is asked for here has all of its level.
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

namespace {

const char* level() {
    __builtin_cpu_init();
    const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
    const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512vl");
    return v4 ? "x86-64-v4" : v3 ? "x86-64-v3" : "x86-64";
}

}  // namespace

int main(int, char** argv) {
    std::error_code error;
    const auto here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    const std::string program = (here.parent_path() / "lib" / "tandem" / level() / "tandem").string();
    ::execv(program.c_str(), argv);
    std::fprintf(
        stderr, "tandem: %s: cannot be started (%s); install Tandem again\n", program.c_str(), std::strerror(errno));
    return 2;
}
