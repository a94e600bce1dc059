// The module: MPI's own functions behind the table.
#include "common/distribution/mpi/module.h"

#define OMPI_SKIP_MPICXX 1
#include <mpi.h>

#include <algorithm>

namespace {

constexpr int size_tag = 1, bytes_tag = 2;
constexpr std::uint64_t most_bytes = std::uint64_t{1} << 30u;  // MPI counts in int

template <class Byte, class Transfer>
void in_chunks(Byte* bytes, std::uint64_t count, const Transfer& transfer) {
    for (std::uint64_t at = 0; at < count; at += most_bytes)
        transfer(bytes + at, static_cast<int>(std::min(most_bytes, count - at)));
}

bool start(int* rank, int* size) {
    int provided = 0;
    if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided) != MPI_SUCCESS) return false;
    MPI_Comm_rank(MPI_COMM_WORLD, rank);
    MPI_Comm_size(MPI_COMM_WORLD, size);
    return provided >= MPI_THREAD_SERIALIZED;
}

void send(int to, const void* bytes, std::uint64_t count) {
    MPI_Send(&count, 1, MPI_UINT64_T, to, size_tag, MPI_COMM_WORLD);
    in_chunks(static_cast<const char*>(bytes), count,
        [to](const char* at, int part) { MPI_Send(at, part, MPI_BYTE, to, bytes_tag, MPI_COMM_WORLD); });
}

bool is_waiting(int from, std::uint64_t* count) {
    int there = 0;
    MPI_Iprobe(from, size_tag, MPI_COMM_WORLD, &there, MPI_STATUS_IGNORE);
    if (there == 0) return false;
    MPI_Recv(count, 1, MPI_UINT64_T, from, size_tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return true;
}

void receive(int from, void* bytes, std::uint64_t count) {
    in_chunks(static_cast<char*>(bytes), count, [from](char* at, int part) {
        MPI_Recv(at, part, MPI_BYTE, from, bytes_tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    });
}

void finish() { MPI_Finalize(); }

}  // namespace

extern "C" const tandem::MpiModule* tandem_mpi_module() {
    static constexpr tandem::MpiModule module{start, send, is_waiting, receive, finish};
    return &module;
}
