#include "vulkan/framework/spirv_merging.h"

#include <initializer_list>
#include <map>
#include <utility>

#include "common/error.h"
#include "vulkan/framework/spirv_words.h"

namespace tandem {

namespace {

using Words = std::span<const std::uint32_t>;

// Numbers of SPIR-V.
enum Op : std::uint32_t {
    op_entry_point = 15,
    op_type_int = 21,
    op_type_runtime_array = 29,
    op_type_struct = 30,
    op_type_pointer = 32,
    op_constant = 43,
    op_function = 54,
    op_variable = 59,
    op_load = 61,
    op_access_chain = 65,
    op_in_bounds_access_chain = 66,
    op_decorate = 71,
    op_member_decorate = 72,
    op_i_add = 128,
    op_u_div = 134,
};
enum Decoration : std::uint32_t { block = 2, array_stride = 6, binding = 33, descriptor_set = 34, offset = 35 };
enum StorageClass : std::uint32_t { uniform = 2, storage_buffer = 12 };

// A storage block that becomes a part of its set's one buffer.
struct Part {
    std::uint32_t set, binding, stride;
    std::uint32_t binding_constant, stride_constant;
};

class Merging {
public:
    Merging(Words code, const std::vector<SetBindings>& separate) : separate_(separate), bound_(code[3]) {
        spirv::for_each_instruction(code, [&](Words instruction) { learn(instruction); });
        if (parts_.empty()) {
            result_.assign(code.begin(), code.end());
            return;
        }
        if (uint_ == 0) throw Error("a shader without unsigned integers has no storage buffers to merge");
        pointer_to_places_ = new_id(), pointer_to_uint_ = new_id(), places_type_ = new_id();
        for (auto& [variable, part] : parts_) {
            part.binding_constant = new_id(), part.stride_constant = new_id();
            if (!places_.contains(part.set)) places_[part.set] = new_id();
        }
        result_.assign(code.begin(), code.begin() + spirv::header_words);
        spirv::for_each_instruction(code, [&](Words instruction) { rewrite(instruction); });
        result_[3] = bound_;
    }

    [[nodiscard]] std::vector<std::uint32_t> result() && { return std::move(result_); }

private:
    std::uint32_t new_id() { return bound_++; }

    void emit(Op opcode, std::initializer_list<std::uint32_t> operands) {
        result_.push_back(static_cast<std::uint32_t>(operands.size() + 1) << 16 | opcode);
        result_.insert(result_.end(), operands);
    }

    void learn(Words w) {
        switch (spirv::opcode_of(w)) {
            case op_decorate:
                if (w[2] == array_stride) strides_[w[1]] = w[3];
                if (w[2] == descriptor_set) sets_[w[1]] = w[3];
                if (w[2] == binding) bindings_[w[1]] = w[3];
                break;
            case op_type_int:
                if (w[2] == 32 && w[3] == 0) uint_ = w[1];
                break;
            case op_type_runtime_array:
                if (strides_.contains(w[1])) arrays_[w[1]] = strides_.at(w[1]);  // else one of descriptors
                break;
            case op_type_struct:
                if (w.size() == 3 && arrays_.contains(w[2])) blocks_[w[1]] = arrays_.at(w[2]);
                break;
            case op_type_pointer:
                if (w[2] == storage_buffer && blocks_.contains(w[3])) pointers_[w[1]] = blocks_.at(w[3]);
                break;
            case op_variable:
                if (w[3] == storage_buffer) learn_variable(w);
                break;
            default:
                break;
        }
    }

    void learn_variable(Words w) {
        const std::uint32_t set = sets_.at(w[2]);
        if (set >= separate_.size() || !is_merged(separate_[set])) return;
        if (!pointers_.contains(w[1])) throw Error("a storage block that is no array cannot be a part of a buffer");
        parts_[w[2]] = {set, bindings_.at(w[2]), pointers_.at(w[1]), 0, 0};
    }

    void copy(Words w) { result_.insert(result_.end(), w.begin(), w.end()); }

    void rewrite(Words w) {
        const std::uint32_t opcode = spirv::opcode_of(w);
        if (opcode == op_decorate && !std::exchange(decorated_, true)) decorate_places();
        if (opcode == op_function && !std::exchange(within_, true)) declare_places();
        if (opcode == op_entry_point) {
            result_.push_back(static_cast<std::uint32_t>(w.size() + places_.size()) << 16 | op_entry_point);
            copy(w.subspan(1));
            for (const auto& [set, variable] : places_) result_.push_back(variable);
        } else if (opcode == op_decorate && w[2] == binding && parts_.contains(w[1])) {
            emit(op_decorate, {w[1], w[2], whole_binding(separate_[parts_.at(w[1]).set])});
        } else if (within_ && (opcode == op_access_chain || opcode == op_in_bounds_access_chain) &&
                   parts_.contains(w[3]) && w.size() > 5) {
            access(w, parts_.at(w[3]));
        } else {
            if (within_) check_uses(w);
            copy(w);
        }
    }

    // What else takes a pointer to a whole block: OpArrayLength, or a chain that ends at its array.
    void check_uses(Words w) const {
        constexpr std::uint32_t op_array_length = 68;
        const std::uint32_t opcode = spirv::opcode_of(w);
        const bool takes = opcode == op_array_length || opcode == op_access_chain ||
                           opcode == op_in_bounds_access_chain || opcode == op_load;
        if (takes && parts_.contains(w[3])) throw Error("a merged storage block is used but element by element");
    }

    void decorate_places() {
        emit(op_decorate, {places_type_, block});
        for (std::uint32_t member = 0; member < most_bindings(separate_); ++member)
            emit(op_member_decorate, {places_type_, member, offset, member * 4});
        for (const auto& [set, variable] : places_) {
            emit(op_decorate, {variable, descriptor_set, set});
            emit(op_decorate, {variable, binding, places_binding(separate_[set])});
        }
    }

    void declare_places() {
        result_.push_back((most_bindings(separate_) + 2) << 16 | op_type_struct);
        result_.push_back(places_type_);
        result_.insert(result_.end(), most_bindings(separate_), uint_);
        emit(op_type_pointer, {pointer_to_places_, uniform, places_type_});
        emit(op_type_pointer, {pointer_to_uint_, uniform, uint_});
        for (const auto& [set, variable] : places_) emit(op_variable, {pointer_to_places_, variable, uniform});
        for (const auto& [variable, part] : parts_) {
            emit(op_constant, {uint_, part.binding_constant, part.binding});
            emit(op_constant, {uint_, part.stride_constant, part.stride});
        }
    }

    // The chain's indices: the block's only member, the element, and what is within.
    void access(Words w, const Part& part) {
        const std::uint32_t place = new_id(), bytes = new_id(), elements = new_id(), element = new_id();
        emit(op_access_chain, {pointer_to_uint_, place, places_.at(part.set), part.binding_constant});
        emit(op_load, {uint_, bytes, place});
        emit(op_u_div, {uint_, elements, bytes, part.stride_constant});
        emit(op_i_add, {uint_, element, elements, w[5]});
        copy(w.first(5));
        result_.push_back(element);
        copy(w.subspan(6));
    }

    const std::vector<SetBindings>& separate_;
    std::uint32_t bound_;
    std::vector<std::uint32_t> result_;
    std::map<std::uint32_t, std::uint32_t> strides_, sets_, bindings_;   // as decorated
    std::map<std::uint32_t, std::uint32_t> arrays_, blocks_, pointers_;  // stride by type
    std::map<std::uint32_t, Part> parts_;                                // by variable
    std::map<std::uint32_t, std::uint32_t> places_;                      // variable by set
    std::uint32_t uint_ = 0, pointer_to_places_ = 0, pointer_to_uint_ = 0, places_type_ = 0;
    bool decorated_ = false, within_ = false;
};

}  // namespace

std::vector<std::uint32_t> with_merged_buffers(
    std::span<const std::uint32_t> code, const std::vector<SetBindings>& separate) {
    return Merging(code, separate).result();
}

}  // namespace tandem
