// The pack as a folder: layout, manifest, same bytes, swap, up to date.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <nlohmann/json.hpp>

#include "formats/read_pack.h"
#include "formats/staging.h"
#include "tests/formats/write_test_util.h"

namespace texel::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string findings_text(const std::string& folder) {
  std::string text;
  for (const CheckFinding& f : check_pack(folder)) text += "[" + f.id + "] " + f.file + ": " + f.text + "\n";
  return text;
}

// A PID no process has: that of a child that has been waited for.
pid_t dead_pid() {
  const pid_t pid = fork();
  if (pid == 0) _exit(0);
  waitpid(pid, nullptr, 0);
  return pid;
}

std::string error_of(const std::function<void()>& f, Code code) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.code, code) << e.what();
    EXPECT_THAT(e.what(), ::testing::Not(HasSubstr("\n")));
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(Sha256, KnowsTheStandardsExamples) {
  const TempFolder folder;  // FIPS 180-4
  put_bytes(folder / "abc", "abc");
  put_bytes(folder / "million", std::string(1000000, 'a'));
  std::int64_t bytes = 0;
  EXPECT_EQ(file_sha256(folder / "abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(file_sha256(folder / "million", &bytes), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_EQ(bytes, 1000000);
  error_of([&] { (void)file_sha256(folder / "nothing"); }, Code::kFile);
}

TEST(WritePack, MakesTheLayoutOfTheContract) {
  const TempFolder folder;
  save(ball_pack({.n = 12, .levels = 3, .slice_levels = 1}), folder / "deep/er/ball.texel");
  std::set<std::string> files;
  for (const auto& [name, bytes] : contents(folder / "deep/er/ball.texel")) files.insert(name);
  std::set<std::string> expected{"manifest.json", "volume.vdb", "volume_level_1.vdb", "volume_level_2.vdb", "preview.png"};
  char name[64];
  for (const char* axis : {"x", "y", "z"})
    for (int k = 0; k < (*axis == 'z' ? 15 : 12); ++k) {
      std::snprintf(name, sizeof name, "slices/%s/%04d.png", axis, k);
      expected.insert(name);
      std::snprintf(name, sizeof name, "slices/level_1/%s/%04d.png", axis, k / 2);
      expected.insert(name);
    }
  EXPECT_EQ(files, expected);
  EXPECT_EQ(findings_text(folder / "deep/er/ball.texel"), "");
}

TEST(WritePack, LeavesOutWhatIsNotWanted) {
  const TempFolder folder;
  save(ball_pack({.n = 8, .levels = 0, .preview = false}), folder / "slices");
  save(ball_pack({.n = 8, .levels = 2, .slices = false, .preview = false}), folder / "volume");
  EXPECT_FALSE(fs::exists(folder / "slices/volume.vdb"));
  EXPECT_FALSE(fs::exists(folder / "slices/preview.png"));
  EXPECT_FALSE(fs::exists(folder / "volume/slices"));
  EXPECT_EQ(findings_text(folder / "slices") + findings_text(folder / "volume"), "");
  EXPECT_TRUE(read_pack(folder / "slices").levels.empty());
}

// Run by the next test in a process of its own, since a module that is loaded stays so.
TEST(SlicesHelper, WritesSlicesOnly) {
  const char* target = std::getenv("TEXEL_SLICES_TARGET");
  if (!target) GTEST_SKIP() << "the process that WritePack.DoesNotLoadOpenVdbForSlices starts";
  save(ball_pack({.n = 8, .levels = 0}), target);
  EXPECT_EQ(bytes_of("/proc/self/maps").find("texel_vdb.so"), std::string::npos);
  save(ball_pack({.n = 8, .levels = 1}), target);  // the look into /proc would see it
  EXPECT_NE(bytes_of("/proc/self/maps").find("texel_vdb.so"), std::string::npos);
}

TEST(WritePack, DoesNotLoadOpenVdbForSlices) {
  const TempFolder folder;
  const pid_t pid = fork();
  if (pid == 0) {
    setenv("TEXEL_SLICES_TARGET", (folder / "slices").c_str(), 1);
    execl("/proc/self/exe", "formats_write_test", "--gtest_filter=SlicesHelper.*", "--gtest_brief=1",
          static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(fs::exists(folder / "slices/volume.vdb"));  // it was not skipped
}

TEST(WritePack, SaysInTheManifestWhatIsInThePack) {
  const TempFolder folder;
  put_bytes(folder / "in/ball.obj", "v 0 0 0\n");
  Pack pack = ball_pack({.n = 12, .levels = 2, .slice_levels = 1});
  pack.cyclic = {true, false, true};
  pack.sources = {{folder / "in/ball.obj", "", 0}, {"/etc/hostname", std::string(64, 'a'), 7}};
  pack.statistics.area = 0.1;  // no short binary fraction
  pack.errors.push_back({"unknown", std::nan(""), "was not measured"});
  pack.issues.push_back({"odd-name", "material \xff\xfe is odd", 1, ""});
  save(pack, folder / "out/ball.texel");
  const std::string text = bytes_of(folder / "out/ball.texel/manifest.json");
  const json m = json::parse(text);
  EXPECT_EQ(m["format"], "texel-pack");
  EXPECT_EQ(m["version"], 1);
  EXPECT_THAT(m["generator"].get<std::string>(), ::testing::MatchesRegex("texel [0-9]+\\.[0-9]+\\.[0-9]+"));
  EXPECT_EQ(m["source"][0], (json{{"path", "../../in/ball.obj"}, {"sha256", file_sha256(folder / "in/ball.obj")}, {"bytes", 8}}));
  EXPECT_EQ(m["source"][1]["path"], "hostname");  // shares nothing but the root with the pack
  EXPECT_EQ(m["recipe"]["voxel_size"], 0.1);
  EXPECT_EQ(m["box"]["min"], (json{-1.5, 2.0, 0.25}));
  EXPECT_EQ(m["box"]["max"], (json{0.0, 3.5, 0.25 + 15 * 0.125}));
  EXPECT_EQ(m["resolution"], (json{12, 12, 15}));
  EXPECT_EQ(m["voxel_size"], 0.125);
  EXPECT_EQ(m["cyclic"], (json{true, false, true}));
  ASSERT_EQ(m["levels"].size(), 2u);
  EXPECT_EQ(m["levels"][1]["file"], "volume_level_1.vdb");
  EXPECT_EQ(m["levels"][1]["resolution"], (json{6, 6, 8}));
  EXPECT_EQ(m["levels"][1]["voxel_size"], 0.25);
  EXPECT_EQ(m["levels"][0]["sha256"], file_sha256(folder / "out/ball.texel/volume.vdb"));
  EXPECT_EQ(m["levels"][0]["bytes"], fs::file_size(folder / "out/ball.texel/volume.vdb"));
  EXPECT_EQ(m["levels"][0]["active_voxels"], pack.levels[0].layers[2].set.count);  // colour covers the rest
  ASSERT_EQ(m["levels"][0]["grids"].size(), 9u);
  EXPECT_EQ(m["levels"][0]["grids"][1], (json{{"name", "alpha"}, {"type", "vec3s"}, {"components", 3}, {"stored_as", "half"},
                                              {"active_voxels", pack.levels[0].layers[0].set.count + 512 * static_cast<std::int64_t>(pack.levels[0].layers[0].tiles.size())}}));
  EXPECT_EQ(m["slices"]["z"]["count"], 15);
  EXPECT_EQ(m["slices"]["x"]["height"], 15);
  EXPECT_EQ(m["slices"]["z"]["pattern"], "slices/z/%04d.png");
  EXPECT_EQ(m["slices"]["z"]["color_space"], "sRGB");
  EXPECT_EQ(m["slices"]["z"]["alpha"], "straight");
  EXPECT_EQ(m["slices"]["z"]["spacing"], 0.125);
  EXPECT_EQ(m["slices"]["z"]["levels"][0]["pattern"], "slices/level_1/z/%04d.png");
  std::string together;
  for (int k = 0; k < 15; ++k) together += bytes_of(folder / "out/ball.texel" + "/slices/z/00" + (k < 10 ? "0" : "") + std::to_string(k) + ".png");
  put_bytes(folder / "together", together);
  EXPECT_EQ(m["slices"]["z"]["sha256"], file_sha256(folder / "together"));
  EXPECT_EQ(m["slices"]["z"]["bytes"], together.size());
  EXPECT_EQ(m["preview"]["sha256"], file_sha256(folder / "out/ball.texel/preview.png"));
  EXPECT_EQ(m["error"]["axis_alpha_rms"]["value"], 0.001953125);
  EXPECT_TRUE(m["error"]["unknown"]["value"].is_null());
  EXPECT_EQ(m["issues"][0]["where"], "ball.obj:17");
  EXPECT_EQ(m["skipped"][0]["what"], "texture leaf.png");
  EXPECT_THAT(text, ::testing::Not(HasSubstr(folder.path().filename().string())));

  const Pack back = read_pack(folder / "out/ball.texel");
  EXPECT_EQ(back.statistics.area, 0.1);  // exact: numbers are written so that they read back
  EXPECT_EQ(back.statistics.volume, pack.statistics.volume);
  EXPECT_EQ(back.statistics.mean_color, pack.statistics.mean_color);
  EXPECT_EQ(back.cyclic, pack.cyclic);
  EXPECT_EQ(back.recipe_json, pack.recipe_json);
  EXPECT_EQ(back.grid.origin, pack.grid.origin);
  EXPECT_EQ(back.slices[0].max_angle, pack.slices[0].max_angle);
  EXPECT_EQ(back.issues.size(), 2u);
}

TEST(WritePack, GivesTheSameBytesForAnyThreadCountAndPlace) {
  const TempFolder folder;
  const Pack pack = ball_pack({.n = 64, .levels = 3});
  save(pack, folder / "first");
  const auto first = contents(folder / "first");
  EXPECT_GT(first.size(), 190u);
  for (const int threads : {1, 2, 4}) {
    save(pack, folder / "again", {.threads = threads});
    EXPECT_TRUE(contents(folder / "again") == first) << threads << " threads";
  }
  save(pack, folder / "else/where/quite");
  EXPECT_TRUE(contents(folder / "else/where/quite") == first);
}

TEST(WritePack, ReplacesAPackAndAnEmptyFolderAndNothingElse) {
  const TempFolder folder;
  save(ball_pack({.n = 12}), folder / "ball");
  save(ball_pack({.n = 8, .levels = 1, .slices = false}), folder / "ball/");
  EXPECT_EQ(findings_text(folder / "ball"), "");
  EXPECT_FALSE(fs::exists(folder / "ball/slices"));
  fs::create_directory(folder / "empty");
  save(ball_pack({.n = 8, .levels = 0}), folder / "empty");

  put_bytes(folder / "home/letter.txt", "dear");
  put_bytes(folder / "other/manifest.json", R"({"format":"other"})");
  put_bytes(folder / "file", "x");
  for (const char* name : {"home", "other", "file"}) {
    const auto before = fs::is_directory(folder / name) ? contents(folder / name) : std::map<std::string, std::string>{};
    error_of([&] { save(ball_pack({.n = 8, .levels = 0}), folder / name); }, Code::kFile);
    if (fs::is_directory(folder / name)) { EXPECT_TRUE(contents(folder / name) == before); }
  }
  EXPECT_EQ(bytes_of(folder / "file"), "x");
  error_of([&] { save(ball_pack({.n = 8, .levels = 0}), folder / "file/in/it"); }, Code::kFile);
  error_of([&] { save(ball_pack({.n = 8, .levels = 0}), ""); }, Code::kFile);
  error_of([&] { save(ball_pack({.n = 8, .levels = 0}), "/"); }, Code::kFile);
  // No temporary folder is left by any of these.
  for (const auto& entry : fs::directory_iterator(folder.path())) EXPECT_NE(entry.path().filename().string()[0], '.');
}

TEST(WritePack, KeepsALinkALink) {
  const TempFolder folder;
  save(ball_pack({.n = 8, .levels = 0}), folder / "real");
  fs::create_directory_symlink("real", folder / "link");
  save(ball_pack({.n = 12, .levels = 0}), folder / "link");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(read_pack(folder / "real").grid.n.x, 12);
}

TEST(WritePack, RemovesLeftoversOfTheDeadOnly) {
  const TempFolder folder;
  const std::string dead = std::to_string(dead_pid());
  put_bytes(folder / ".ball.texel-" + dead + "-0/volume.vdb", "half");
  put_bytes(folder / ".ball.texel-" + dead + "-00/manifest.json", "old");  // the old pack of the rename in two steps
  put_bytes(folder / ".ball.texel-" + std::to_string(getppid()) + "-0/volume.vdb", "lives");
  put_bytes(folder / ".balloon.texel-" + dead + "-0/volume.vdb", "another pack's");
  put_bytes(folder / ".ball.texel-notes/volume.vdb", "not ours");
  save(ball_pack({.n = 8, .levels = 0}), folder / "ball");
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.path())) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"ball", ".ball.texel-" + std::to_string(getppid()) + "-0", ".balloon.texel-" + dead + "-0", ".ball.texel-notes"}));
}

TEST(WritePack, LeavesTheOldPackWhenTheBakerOrTheDiskFails) {
  const TempFolder folder;
  save(ball_pack({.n = 8, .levels = 1}), folder / "ball");
  const auto before = contents(folder.path());
  Pack broken = ball_pack({.n = 12});
  broken.slices[2].image = [](int k) -> Image {
    if (k == 5) throw std::bad_alloc();
    return {};
  };
  EXPECT_ANY_THROW(save(broken, folder / "ball"));
  Pack short_grid = ball_pack({.n = 12});
  short_grid.levels[0].layers[0].channels[0].values.pop_back();
  error_of([&] { save(short_grid, folder / "ball"); }, Code::kRunning);
  Pack no_source = ball_pack({.n = 12});
  no_source.sources = {{folder / "gone.obj", "", 0}};
  error_of([&] { save(no_source, folder / "ball"); }, Code::kFile);
  EXPECT_TRUE(contents(folder.path()) == before);
}

// A child whose files may not grow beyond `limit` bytes: what a full disk looks like to the writer.
int write_with_limit(const Pack& pack, const std::string& target, rlim_t limit, const std::string& log) {
  const pid_t pid = fork();
  if (pid == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit small{limit, limit};
    setrlimit(RLIMIT_FSIZE, &small);
    int status = 99;
    std::string text = "no error";
    try {
      save(pack, target);
    } catch (const Error& e) {
      status = static_cast<int>(e.code);
      text = e.what();
    } catch (const std::exception& e) {
      text = std::string("other: ") + e.what();
    }
    std::ofstream(log) << text.substr(0, limit / 2);
    _exit(status);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(WritePack, SaysWhenTheDiskIsFull) {
  const TempFolder folder;
  const std::string target = folder / "out/ball";
  save(ball_pack({.n = 8, .levels = 1, .slices = false}), target);
  const auto before = contents(folder / "out");
  // Limits that hit the volume; a slice; the manifest alone.
  const Pack volume = ball_pack({.n = 48, .levels = 1, .slices = false, .preview = false});
  EXPECT_EQ(write_with_limit(volume, target, 20000, folder / "log"), static_cast<int>(Code::kRunning)) << bytes_of(folder / "log");
  EXPECT_THAT(bytes_of(folder / "log"), HasSubstr("volume.vdb"));
  const Pack slices = ball_pack({.n = 64, .levels = 0});
  const int status = write_with_limit(slices, target, 400, folder / "log");
  EXPECT_TRUE(status == static_cast<int>(Code::kRunning) || status == static_cast<int>(Code::kFile)) << bytes_of(folder / "log");
  Pack many_issues = ball_pack({.n = 8, .levels = 0, .slices = false, .preview = false});
  for (int i = 0; i < 100; ++i) many_issues.issues.push_back({"id", std::string(100, 'x'), i, ""});
  EXPECT_EQ(write_with_limit(many_issues, target, 4000, folder / "log"), static_cast<int>(Code::kRunning)) << bytes_of(folder / "log");
  EXPECT_THAT(bytes_of(folder / "log"), HasSubstr("manifest.json"));
  EXPECT_TRUE(contents(folder / "out") == before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "out"), {}), 1);
}

// Whoever hears of the progress may stop the writing by throwing: the volume's too, which is written by a library that knows no stopping.
TEST(WritePack, CanBeStoppedAtAnyReport) {
  const TempFolder folder;
  const Pack volume = ball_pack({.n = 64, .levels = 1, .slices = false, .preview = false});
  int whole = 0;
  for (const int last : {1 << 30, 1, 3}) {
    std::atomic<int> calls{0};
    Report report;
    report.progress = [&](const std::string&, double) {
      if (++calls >= last) throw Error(Code::kRunning, "", "interrupted");
    };
    if (last == 1 << 30) {
      write_pack(volume, folder / "kept", {}, report);
      whole = calls;
      EXPECT_GT(whole, 3);
    } else {
      EXPECT_THAT(error_of([&] { write_pack(volume, folder / "out/ball", {}, report); }, Code::kRunning), HasSubstr("interrupted"));
      EXPECT_EQ(calls, last);  // one report after the other in a pack of one volume
      EXPECT_FALSE(fs::exists(folder / "out"));
    }
  }
}

TEST(WritePack, TellsWhatIsTooBrightForPngSlices) {
  const TempFolder folder;
  Pack pack;
  pack.grid.n = V3i(2, 2, 1);
  SliceStack stack{.axis = 2, .level = 0, .count = 1, .width = 2, .height = 2, .thickness = 1, .max_angle = 0, .image = {}};
  // Too bright; not; too bright but not there; above 1 by less than half a step (1.0045), which the last step stands for.
  stack.image = [](int) { return Image{2, 2, 4, {2, 0, 0, 1, 0.5f, 0.5f, 0.5f, 1, 5, 5, 5, 0, 1.004f, 1, 1, 0.5f}}; };
  pack.slices = {stack};
  Report report;
  write_pack(pack, folder / "png", {}, report);
  ASSERT_EQ(report.issues.size(), 1u);
  EXPECT_EQ(report.issues[0].id, "slices-clipped");
  EXPECT_EQ(report.issues[0].count, 1);
  EXPECT_THAT(report.issues[0].text, HasSubstr("33.3 %"));
  EXPECT_EQ(json::parse(bytes_of(folder / "png/manifest.json"))["issues"][0]["id"], "slices-clipped");
  report = {};
  write_pack(pack, folder / "exr", {.slice_format = SliceFormat::kExr}, report);
  EXPECT_THAT(report.issues, IsEmpty());
  pack.slices[0].image = [](int) { return Image{2, 2, 4, std::vector<float>(16, 1)}; };
  write_pack(pack, folder / "white", {}, report);
  EXPECT_THAT(report.issues, IsEmpty());
}

TEST(WritePack, TellsWhenASourceIsKeptByNameAlone) {
  const TempFolder folder;
  put_bytes(folder / "near.obj", "v 1");
  Pack pack = ball_pack({.n = 8, .levels = 1});
  pack.sources = {{folder / "near.obj", "", 0}};
  Report report;
  write_pack(pack, folder / "ball", {}, report);
  EXPECT_THAT(report.skipped, IsEmpty());
  pack.sources.push_back({"/proc/version", "", 0});  // shares no folder with any pack
  write_pack(pack, folder / "ball", {}, report);
  ASSERT_EQ(report.skipped.size(), 1u);
  EXPECT_THAT(report.skipped[0].what, HasSubstr("/proc/version"));
  EXPECT_EQ(json::parse(bytes_of(folder / "ball/manifest.json"))["source"][1]["path"], "version");
}

TEST(Staging, TakesTheFoldersItMadeAwayAgain) {
  const TempFolder folder;
  put_bytes(folder / "here/other", "kept");
  { const StagingFolder staging(folder / "here/a/b/pack"); }
  EXPECT_FALSE(fs::exists(folder / "here/a"));
  EXPECT_TRUE(fs::exists(folder / "here/other"));
  {
    const StagingFolder staging(folder / "here/a/b/pack");
    put_bytes(folder / "here/a/from elsewhere", "kept");  // what another program puts there meanwhile
  }
  EXPECT_FALSE(fs::exists(folder / "here/a/b"));
  EXPECT_TRUE(fs::exists(folder / "here/a/from elsewhere"));
  {
    StagingFolder staging(folder / "new/b/pack");
    staging.commit();
  }
  EXPECT_TRUE(fs::is_directory(folder / "new/b/pack"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "new/b"), {}), 1);
  // A file in the way: nothing is left of what was made before it was met.
  EXPECT_THAT(error_of([&] { const StagingFolder staging(folder / "here/other/pack"); }, Code::kFile), HasSubstr("cannot be made"));
}

TEST(Staging, SwapsInTwoStepsWhereNamesCannotBeExchanged) {
  const TempFolder folder;
  put_bytes(folder / "pack/old", "old");
  {
    StagingFolder staging(folder / "pack");
    put_bytes(staging.file("new"), "new");
    staging.commit(/*exchange=*/false);
    EXPECT_EQ(contents(folder / "pack"), (std::map<std::string, std::string>{{"new", "new"}}));
  }
  EXPECT_EQ(contents(folder.path()), (std::map<std::string, std::string>{{"pack/new", "new"}}));
}

TEST(UpToDate, ComparesSourcesRecipeVersionAndFiles) {
  const TempFolder folder;
  put_bytes(folder / "a.obj", "v 1");
  Pack pack = ball_pack({.n = 8, .levels = 1});
  pack.sources = {{folder / "a.obj", "", 0}};
  save(pack, folder / "ball");
  Scene scene;
  scene.sources = pack.sources;
  std::string why;
  // Order of keys and spaces do not matter.
  EXPECT_TRUE(pack_up_to_date(folder / "ball", scene, R"({ "voxel_size": 0.1, "resolution": [32,32,35], "margin": 1 })", &why)) << why;
  EXPECT_FALSE(pack_up_to_date(folder / "ball", scene, R"({"margin":2,"resolution":[32,32,35],"voxel_size":0.1})", &why));
  EXPECT_THAT(why, HasSubstr("recipe"));
  EXPECT_FALSE(pack_up_to_date(folder / "ball", scene, "not json"));
  EXPECT_FALSE(pack_up_to_date(folder / "none", scene, pack.recipe_json, &why));
  EXPECT_THAT(why, HasSubstr("there is no pack here"));
  put_bytes(folder / "a.obj", "v 2");
  EXPECT_FALSE(pack_up_to_date(folder / "ball", scene, pack.recipe_json, &why));
  EXPECT_THAT(why, HasSubstr("a.obj has changed"));
  put_bytes(folder / "a.obj", "v 1");
  scene.sources.push_back(scene.sources[0]);
  EXPECT_FALSE(pack_up_to_date(folder / "ball", scene, pack.recipe_json));
  scene.sources.pop_back();
  EXPECT_TRUE(pack_up_to_date(folder / "ball", scene, pack.recipe_json));

  for (const char* name : {"volume.vdb", "slices/y/0004.png", "preview.png"}) {
    const std::string path = folder / "ball" + "/" + name, bytes = bytes_of(path);
    put_bytes(path, bytes + "x");
    EXPECT_FALSE(pack_up_to_date(folder / "ball", scene, pack.recipe_json)) << name;
    fs::remove(path);
    EXPECT_FALSE(pack_up_to_date(folder / "ball", scene, pack.recipe_json)) << name;
    put_bytes(path, bytes);
    EXPECT_TRUE(pack_up_to_date(folder / "ball", scene, pack.recipe_json)) << name;
  }
  std::string text = bytes_of(folder / "ball/manifest.json");
  text.replace(text.find("texel 0."), 8, "texel 9.");
  put_bytes(folder / "ball/manifest.json", text);
  EXPECT_FALSE(pack_up_to_date(folder / "ball", scene, pack.recipe_json, &why));
  EXPECT_THAT(why, HasSubstr("made by texel 9."));
}

}  // namespace
}  // namespace texel::test
