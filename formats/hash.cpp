#include "formats/hash.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "formats/error.h"
#include "formats/write.h"

namespace texel {
namespace {

struct Descriptor {
  int fd;
  ~Descriptor() { if (fd >= 0) close(fd); }
};

}  // namespace

struct Sha256::Impl {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  ~Impl() { EVP_MD_CTX_free(context); }
};

Sha256::Sha256() : impl_(std::make_unique<Impl>()) {
  if (!impl_->context || EVP_DigestInit_ex(impl_->context, EVP_sha256(), nullptr) != 1)
    throw Error(Code::kRunning, "", "SHA-256 is not available", "check the OpenSSL configuration");
}

Sha256::~Sha256() = default;

void Sha256::add(const void* data, std::size_t bytes) {
  if (EVP_DigestUpdate(impl_->context, data, bytes) != 1) throw Error(Code::kRunning, "", "SHA-256 failed");
}

std::int64_t Sha256::add_file(const std::string& path) {
  const auto fail = [&] { throw Error(Code::kFile, path, std::string("cannot be read (") + std::strerror(errno) + ")"); };
  const Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  if (file.fd < 0) fail();
  std::vector<char> buffer(std::size_t{1} << 18);
  std::int64_t total = 0;
  for (;;) {
    const ssize_t got = read(file.fd, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail();
    if (got == 0) return total;
    add(buffer.data(), static_cast<std::size_t>(got));
    total += got;
  }
}

std::string Sha256::hex() {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned length = 0;
  if (EVP_DigestFinal_ex(impl_->context, digest, &length) != 1) throw Error(Code::kRunning, "", "SHA-256 failed");
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (unsigned i = 0; i < length; ++i) {
    text += kDigits[digest[i] >> 4];
    text += kDigits[digest[i] & 15];
  }
  return text;
}

std::string file_sha256(const std::string& path, std::int64_t* bytes) {
  Sha256 sum;
  const std::int64_t total = sum.add_file(path);
  if (bytes) *bytes = total;
  return sum.hex();
}

}  // namespace texel
