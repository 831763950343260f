#include "services/behaviours/image.hpp"

#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <system_error>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::uint64_t kGuardOctets = 16 * 1024;
constexpr std::uint64_t kExchangeOctets = page_up(sizeof(KtExchange));
constexpr const char* kTaken =
    "the addresses of these robots' programs are taken by other programs in this process; run the experiments in "
    "processes "
    "of their own";

void* pointer(std::uint64_t address) { return reinterpret_cast<void*>(address); }  // NOLINT

void protect(std::uint64_t address, std::uint64_t size, int protection) {
  if (size > 0 && mprotect(pointer(address), size, protection) != 0) {
    throw RunError(std::string("memory for robots' programs: ") + std::generic_category().message(errno));
  }
}

struct Loaded {
  std::unique_ptr<Program> program;
  std::size_t users = 0;
};

struct Registry {
  std::mutex mutex;
  std::map<std::uint64_t, Loaded> programs;  // by address
};

Registry& registry() {
  static Registry* const instance = new Registry;  // never destroyed, because users may outlive static destructors
  return *instance;
}

}  // namespace

std::uint64_t Slot::size(const ElfFile& file) {
  const std::uint64_t used = 2 * kStackOctets + kExchangeOctets + kPage + file.memory.size() + 4 * kGuardOctets;
  return (used + kAddressStep - 1) / kAddressStep * kAddressStep;
}

Slot::Slot(const ElfFile& file, std::uint64_t address)
    : address_(address),
      size_(size(file)),
      stack_top_(address + kGuardOctets + kStackOctets),
      interrupt_stack_top_(stack_top_ + kGuardOctets + kStackOctets),
      surroundings_(interrupt_stack_top_ + kGuardOctets),
      exchange_(surroundings_ + kPage),
      image_(exchange_ + kExchangeOctets),
      data_offset_(file.data.first),
      watched_words_(std::min(file.pad.last - file.pad.first, kWatchedOctets) / 16 * 2) {
  void* mapped = mmap(pointer(address), size_, PROT_NONE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE, -1, 0);
  if (mapped != pointer(address)) {
    const int error = mapped == MAP_FAILED ? errno : EEXIST;
    if (mapped != MAP_FAILED) munmap(mapped, size_);
    if (error == EEXIST) throw RunError(kTaken);
    throw RunError(std::string("memory for robots' programs: ") + std::generic_category().message(error));
  }
  try {
    protect(stack_top_ - kStackOctets, kStackOctets, PROT_READ | PROT_WRITE);
    protect(interrupt_stack_top_ - kStackOctets, kStackOctets, PROT_READ | PROT_WRITE);
    protect(surroundings_, kPage + kExchangeOctets, PROT_READ | PROT_WRITE);
    protect(image_, file.memory.size(), PROT_READ | PROT_WRITE);
    auto* const image = at<std::uint8_t*>(0);
    std::memcpy(image, file.memory.data(), file.memory.size());
    for (const std::uint32_t offset : file.relocations) {
      std::uint64_t word = 0;
      std::memcpy(&word, image + offset, sizeof word);
      word += image_;
      std::memcpy(image + offset, &word, sizeof word);
    }
    std::memcpy(image + file.table.exchange, &exchange_, sizeof exchange_);
    std::memcpy(image + file.table.surroundings, &surroundings_, sizeof surroundings_);
    protect(image_, file.memory.size(), PROT_NONE);
    for (const ElfFile::Segment& segment : file.segments) {
      const int protection = PROT_READ | (segment.writable ? PROT_WRITE : 0) | (segment.executable ? PROT_EXEC : 0);
      const std::uint64_t first = page_down(segment.range.first);
      const std::uint64_t last = page_up(segment.range.last + (segment.writable ? kSlackOctets : 0));
      protect(image_ + first, last - first, protection);
    }
    protect(image_ + file.relro.first, file.relro.last - file.relro.first, PROT_READ);
    initial_data_.assign(data(), data() + (file.data.last - file.data.first));
  } catch (...) {
    munmap(pointer(address_), size_);
    throw;
  }
}

Slot::~Slot() { munmap(pointer(address_), size_); }

Program::Program(ElfFile parsed, std::string program_name, std::string hash, std::uint64_t first)
    : file(std::move(parsed)),
      name(std::move(program_name)),
      sha256(std::move(hash)),
      address(first),
      end(first + size(file)) {
  KILOTWIN_DEMAND(first >= kFirstAddress && end <= kLastAddress);
  for (std::uint32_t i = 0; i < kSlots; ++i) {
    slots_.push_back(std::make_unique<Slot>(file, address + i * Slot::size(file)));
  }
}

std::shared_ptr<Program> Program::load(ElfFile file, const std::string& name, const std::string& sha256,
                                       std::uint64_t address) {
  // The tests of the cycle budget: cycle_counters.cpp.
  if (!__builtin_cpu_supports("sse4.1"))
    throw RunError(
        "robots' programs need a processor with SSE4.1, and this one has none; a virtual machine may hide it: "
        "give it the processor of its host");
  const std::lock_guard lock(registry().mutex);
  auto entry = registry().programs.find(address);
  if (entry == registry().programs.end()) {
    auto program = std::make_unique<Program>(std::move(file), name, sha256, address);
    entry = registry().programs.emplace(address, Loaded{std::move(program), 0}).first;
  }
  if (entry->second.program->sha256 != sha256) throw RunError(kTaken);
  ++entry->second.users;
  return {entry->second.program.get(), [](Program* program) {
            const std::lock_guard guard(registry().mutex);
            const auto own = registry().programs.find(program->address);
            if (--own->second.users == 0) registry().programs.erase(own);
          }};
}

}  // namespace kilotwin::behaviours
