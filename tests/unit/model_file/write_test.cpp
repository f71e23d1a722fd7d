// SPDX-License-Identifier: Apache-2.0
// A model is written whole or not at all.
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <optional>

#include "core/files/atomic_file.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/model_file/test_files.hpp"

namespace ecorche::test {
namespace {

class Write : public ModelFileTest {};

// Files of this process may not grow beyond `bytes` while it lives: a full disk as seen from inside.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int) = nullptr;
};

TEST_F(Write, AsksForTheExtensionThatParaViewAsksFor) {
  for (const char* name : {"a.h5", "a", "a.hdf5", "a.hdf.part"}) {
    const Error error = error_of([&] { model_file::write(toy_model(), file(name), {}); });
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_EQ(error.problem(), "does not end in .hdf, which ParaView asks for");
    EXPECT_NE(error.mend().find(".hdf"), std::string::npos);
  }
  EXPECT_TRUE(names().empty());
}

TEST_F(Write, RefusesAFolderThatIsNotThere) {
  EXPECT_EQ(error_of([&] { model_file::write(toy_model(), file("no/a.hdf"), {}); }).kind(),
            ErrorKind::cannot_create);
}

TEST_F(Write, AFullDiskLeavesNothing) {
  model_file::write(toy_model(), file("a.hdf"), {});
  const rlim_t whole = std::filesystem::file_size(file("a.hdf"));
  std::filesystem::remove(file("a.hdf"));
  for (const rlim_t limit :
       {rlim_t{0}, rlim_t{100}, rlim_t{2048}, whole / 8, whole / 4, whole / 2, whole - 1}) {
    const FileSizeLimit full(limit);
    const ErrorKind kind = error_of([&] { model_file::write(toy_model(), file("a.hdf"), {}); }).kind();
    EXPECT_EQ(kind, ErrorKind::io) << limit;
    EXPECT_TRUE(names().empty()) << limit;
  }
  model_file::write(toy_model(), file("a.hdf"), {});  // and the library is still in order
  expect_same(model_file::read(file("a.hdf"), {}), toy_model());
}

TEST_F(Write, AFullDiskKeepsTheOlderModel) {
  model_file::write(toy_model(), file("a.hdf"), {});
  const Bytes before = load(file("a.hdf"));
  {
    const FileSizeLimit full(30000);
    EXPECT_EQ(error_of([&] { model_file::write(full_model(), file("a.hdf"), {}); }).kind(), ErrorKind::io);
  }
  EXPECT_EQ(load(file("a.hdf")), before);
  EXPECT_EQ(names(), std::vector<std::string>{"a.hdf"});
}

// The room was there, and is not when the bytes come.
TEST_F(Write, ADiskThatFillsUpMeanwhileLeavesNothing) {
  std::optional<FileSizeLimit> full;
  Context context;
  context.progress = [&](double) {
    if (!full) full.emplace(4096);
  };
  const Error error = error_of([&] { model_file::write(toy_model(), file("a.hdf"), context); });
  EXPECT_EQ(error.kind(), ErrorKind::io);
  EXPECT_EQ(error.problem().find("writing failed: "), 0U) << error.what();
  full.reset();
  EXPECT_TRUE(names().empty());
}

TEST_F(Write, EveryStepOfAFileMayFail) {
  {
    files::AtomicFile gone(file("a"));
    std::filesystem::remove(gone.temporary());
    EXPECT_EQ(error_of([&] { gone.commit(); }).problem(), "cannot flush: No such file or directory");
  }
  {
    files::AtomicFile half(file("a"));
    std::ofstream(half.temporary()) << std::string(500, 'a');
    const FileSizeLimit full(1000);
    EXPECT_EQ(error_of([&] { half.commit(); }).problem(), "cannot be written whole: File too large");
  }
  {
    files::AtomicFile late(file("a"));
    std::ofstream(late.temporary()) << "a";
    std::filesystem::create_directory(file("a"));
    EXPECT_EQ(error_of([&] { late.commit(); }).problem(), "cannot rename: Is a directory");
    std::filesystem::remove(file("a"));
  }
  {
    const FileSizeLimit full(1000);
    const Error error = error_of([&] { files::write_text(file("a"), std::string(100000, 'a')); });
    EXPECT_EQ(std::string(error.what()),
              file("a").string() + ": writing failed (check the disk's free space)");
  }
  const Error error =
      error_of([] { files::read_text("/proc/self/mem", 1 << 20); });  // which the kernel refuses to read
  EXPECT_STREQ(error.what(), "/proc/self/mem: reading failed (check the disk)");
  EXPECT_TRUE(names().empty());
}

TEST_F(Write, AStopHalfWayLeavesNothing) {
  for (const double when : {0.0, 0.3, 0.9, 1.0}) {
    std::stop_source source;
    Context context;
    context.stop = source.get_token();
    context.progress = [&](double fraction) {
      if (fraction >= when) source.request_stop();
    };
    EXPECT_EQ(error_of([&] { model_file::write(toy_model(), file("a.hdf"), context); }).kind(),
              ErrorKind::interrupted);
    EXPECT_TRUE(names().empty());
  }
}

TEST_F(Write, RefusesAModelThatReadWouldRefuse) {
  Model model = toy_model();
  model.tissues[4].name = "../muscle";
  const Error error = error_of([&] { model_file::write(model, file("a.hdf"), {}); });
  EXPECT_EQ(error.kind(), ErrorKind::internal);
  EXPECT_NE(std::string(error.what()).find("../muscle"), std::string::npos);
  EXPECT_TRUE(names().empty());
}

}  // namespace
}  // namespace ecorche::test
