// What the program asks of MPI: a table of functions in a module of its own (module.cpp), which is loaded where mpirun
// started the program. Without MPI the program is built and runs all the same.
#pragma once

#include <cstdint>

namespace tandem {

// Messages are whole: their bytes arrive in the order sent. No two threads call at once.
struct MpiModule {
    bool (*start)(int* rank, int* size);
    void (*send)(int to, const void* bytes, std::uint64_t count);
    bool (*is_waiting)(int from, std::uint64_t* count);  // a message, whose bytes are then to be received
    void (*receive)(int from, void* bytes, std::uint64_t count);
    void (*finish)();
};

inline constexpr const char* mpi_module_file = "libtandem_mpi.so";
inline constexpr const char* mpi_module_name = "tandem_mpi_module";  // const MpiModule*(*)()

}  // namespace tandem
