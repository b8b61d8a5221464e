#include "scenes/mesh_files/mesh_cache.hpp"

#include <fcntl.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "models/base/sha256.hpp"
#include "scenes/mesh_files/mesh_file.hpp"

namespace proxarm::scenes {
namespace {

using models::TriangleMesh;
using Bytes = std::span<const std::byte>;
using Digest = Sha256::Digest;

// Size in bytes from which on a mesh file gets a cache: about 20,000 triangles. Smaller files load fast without a
// cache.
constexpr std::uintmax_t kSmallest = 1'000'000;

struct Header {
  std::array<char, 16> magic{'p', 'r', 'o', 'x', 'a', 'r', 'm', ' ', 'm', 'e', 's', 'h', ' ', '3', '\n', '\0'};
  Digest content{};
  std::uint64_t vertices = 0, triangles = 0, nodes = 0, dropped = 0, closed = 0;
  FaceAccount account;
};

template <typename T>
std::span<std::byte> bytes_of(std::vector<T>& items) {
  return std::as_writable_bytes(std::span(items));
}
template <typename T>
Bytes bytes_of(const std::vector<T>& items) {
  return std::as_bytes(std::span(items));
}
template <typename T>
Bytes bytes_of(const T& item) {
  return std::as_bytes(std::span(&item, 1));
}

bool read(std::istream& in, std::span<std::byte> bytes) {
  return static_cast<bool>(in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())));
}

std::optional<Digest> content_of(const std::filesystem::path& file, const MeshPlacement& placement) {
  Sha256 hash;
  const std::string extension = file.extension().string();
  hash.add(std::as_bytes(std::span(extension)));
  hash.add(bytes_of(placement.scale));
  hash.add(std::as_bytes(std::span(placement.pose_W.data(), 16)));
  hash.add(bytes_of(placement.anchor));
  hash.add(bytes_of(placement.weld_m.value_or(-1.0)));
  hash.add(bytes_of(placement.close_holes_m));
  std::ifstream in(file, std::ios::binary);
  std::vector<std::byte> some(1 << 20);
  while (read(in, some)) hash.add(some);
  if (!in.eof()) return std::nullopt;
  hash.add(std::span(some).first(static_cast<std::size_t>(in.gcount())));
  return hash.digest();
}

std::optional<std::filesystem::path> cache_folder() {
  for (const auto& [variable, below] : {std::pair{"XDG_CACHE_HOME", "proxarm"}, std::pair{"HOME", ".cache/proxarm"}}) {
    const char* const folder = std::getenv(variable);
    if (folder != nullptr && folder[0] == '/') return std::filesystem::path(folder) / below;
  }
  return std::nullopt;
}

class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  ~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const noexcept { return descriptor_; }

 private:
  int descriptor_;
};

bool write(const Descriptor& out, Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(out.get(), bytes.data(), bytes.size());
    if (written <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

// Creates a new file. Fails if the name exists, even as a link; an existing file stays unchanged.
Descriptor create(const std::string& file, ::mode_t mode) {
  return Descriptor(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
}

// Returns this user's secret, which is created if it is missing. nullopt if the secret can't be stored, or if others
// could read it.
std::optional<Digest> secret() {
  const auto folder = cache_folder();
  if (!folder) return std::nullopt;
  std::error_code error;
  std::filesystem::create_directories(*folder, error);
  const std::string file = (*folder / "mesh-key").string();
  Digest key{};
  if (const Descriptor fresh = create(file, 0600); fresh.get() >= 0) {
    const bool kept = RAND_bytes(key.data(), static_cast<int>(key.size())) == 1 && write(fresh, bytes_of(key));
    if (!kept) ::unlink(file.c_str());
    return kept ? std::optional(key) : std::nullopt;
  }
  const Descriptor old(::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  struct stat status {};
  const bool ours = old.get() >= 0 && ::fstat(old.get(), &status) == 0 && S_ISREG(status.st_mode) &&
                    status.st_uid == ::geteuid() && (status.st_mode & 077) == 0 &&
                    ::read(old.get(), key.data(), key.size()) == static_cast<ssize_t>(key.size());
  return ours ? std::optional(key) : std::nullopt;
}

std::optional<Digest> signature(const Header& header, const TriangleMesh::Structure& structure, const Digest& secret) {
  Sha256 hash;
  hash.add(bytes_of(header));
  hash.add(bytes_of(structure.vertices));
  hash.add(bytes_of(structure.triangles));
  hash.add(bytes_of(structure.nodes));
  const auto digest = hash.digest();
  Digest signature{};
  if (!digest || HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), digest->data(), digest->size(),
                      signature.data(), nullptr) == nullptr) {
    return std::nullopt;
  }
  return signature;
}

}  // namespace

MeshCache::MeshCache(const std::filesystem::path& mesh_file, const MeshPlacement& placement)
    : file_(mesh_file.string() + ".proxarm") {
  std::error_code error;
  const auto size = std::filesystem::file_size(mesh_file, error);
  if (error || size < kSmallest) return;
  const auto key = secret();
  const auto content = key ? content_of(mesh_file, placement) : std::nullopt;
  if (!content) return;
  used_ = true;
  secret_ = *key;
  content_ = *content;
}

std::optional<CachedMesh> MeshCache::load() const {
  std::error_code error;
  if (!used_ || !std::filesystem::is_regular_file(file_, error)) return std::nullopt;
  std::ifstream in(file_, std::ios::binary);
  Header header;
  if (!read(in, std::as_writable_bytes(std::span(&header, 1)))) return std::nullopt;
  constexpr std::uint64_t most = 1u << 29;
  if (header.magic != Header{}.magic || header.content != content_ || header.vertices > most ||
      header.triangles > most || header.nodes > most) {
    return std::nullopt;
  }
  TriangleMesh::Structure structure;
  const std::uint64_t size = sizeof(Header) + header.vertices * sizeof(structure.vertices[0]) +
                             header.triangles * sizeof(structure.triangles[0]) +
                             header.nodes * sizeof(structure.nodes[0]) + sizeof(Digest);
  if (std::filesystem::file_size(file_, error) != size) return std::nullopt;  // checked before memory is allocated
  structure.vertices.resize(header.vertices);
  structure.triangles.resize(header.triangles);
  structure.nodes.resize(header.nodes);
  structure.dropped = header.dropped;
  structure.closed = header.closed != 0;
  Digest signed_as{};
  if (!read(in, bytes_of(structure.vertices)) || !read(in, bytes_of(structure.triangles)) ||
      !read(in, bytes_of(structure.nodes)) || !read(in, std::as_writable_bytes(std::span(&signed_as, 1))) ||
      signature(header, structure, secret_) != signed_as) {
    return std::nullopt;
  }
  return CachedMesh{std::move(structure), header.account};
}

void MeshCache::store(const CachedMesh& mesh) const {
  if (!used_) return;
  const TriangleMesh::Structure& structure = mesh.structure;
  Header header;
  header.content = content_;
  header.vertices = structure.vertices.size();
  header.triangles = structure.triangles.size();
  header.nodes = structure.nodes.size();
  header.dropped = structure.dropped;
  header.closed = structure.closed ? 1 : 0;
  header.account = mesh.account;
  const auto signed_as = signature(header, structure, secret_);
  if (!signed_as) return;
  // Write to a file beside the final place, then rename it. So the cache appears either complete or not at all.
  const std::string beside = file_.string() + "." + std::to_string(::getpid());
  const Descriptor out = create(beside, 0644);
  if (out.get() < 0) return;
  const bool whole = write(out, bytes_of(header)) && write(out, bytes_of(structure.vertices)) &&
                     write(out, bytes_of(structure.triangles)) && write(out, bytes_of(structure.nodes)) &&
                     write(out, bytes_of(*signed_as));
  std::error_code error;
  if (whole) std::filesystem::rename(beside, file_, error);
  if (!whole || error) std::filesystem::remove(beside, error);
}

}  // namespace proxarm::scenes
