/// Checks of Python's objects before a call uses them: they must be initialized, and no call in
/// another thread may be changing them.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "sdnn/core/detail/interruption.hpp"

// This function marks the namespaces of the library: argument-dependent lookup finds it for their
// classes. It is declared once and imported into each namespace, so that lookup is not ambiguous
// for templates whose arguments are of several namespaces.
namespace sdnn::library {
void is_of_library(const void*);
}
namespace sdnn::agents {
using library::is_of_library;
}
namespace sdnn::approximators {
using library::is_of_library;
}
namespace sdnn::coding {
using library::is_of_library;
}
namespace sdnn::environments {
using library::is_of_library;
}
namespace sdnn::estimators {
using library::is_of_library;
}
namespace sdnn::tools {
using library::is_of_library;
}

namespace sdnn::bindings {

/// Whether `T` is a template over other types, such as a container. Bound templates of the library
/// need a specialization that is false.
template <class T>
inline constexpr bool kIsComposed = false;
template <template <class...> class Template, class... Types>
inline constexpr bool kIsComposed<Template<Types...>> = true;

/// Classes of the namespaces above, whose arguments are checked.
template <class T>
concept LibraryClass =
    std::is_class_v<T> && !kIsComposed<T> && requires(T* object) { is_of_library(object); };

/// A class of the library in Python. Others do not compile: their objects would not be checked.
template <LibraryClass T, class... Options>
using Class = pybind11::class_<T, Options...>;

/// How a call uses memory: it reads or changes it without the GIL, or waits until it can change it.
enum class Access { read, change, wait_to_change };

/// Memory that a running call uses, and how. The GIL guards the list of all uses.
struct Use {
  const void* owner;  ///< the C++ object whose lifetime is that of the use
  const std::byte* begin;
  const std::byte* end;
  Access access;
  std::thread::id thread = std::this_thread::get_id();

  /// Describes the use of an object with its members; const ones are read, others are changed.
  template <class Object>
  static Use of(const void* owner, Object& object) noexcept {
    const auto* const begin = reinterpret_cast<const std::byte*>(&object);
    return {owner, begin, begin + sizeof(Object), access_to<Object>()};
  }

  /// Describes the use of memory that belongs to an object but lies outside it, such as networks.
  template <class Part>
  static Use of(const void* owner, const std::span<Part>& parts) noexcept {
    const auto bytes = std::as_bytes(parts);
    return {owner, bytes.data(), bytes.data() + bytes.size(), access_to<Part>()};
  }

  template <class T>
  static constexpr Access access_to() noexcept {
    return std::is_const_v<T> ? Access::read : Access::change;
  }

  static std::vector<Use>& all() {
    static std::vector<Use> uses;
    return uses;
  }

  bool overlaps(const Use& other) const noexcept {
    return std::less<>()(begin, other.end) && std::less<>()(other.begin, end);
  }
};

/// Throws std::runtime_error if another call is changing the memory, or is reading it while this
/// call wants to change it. A change that only waits for its turn does not count.
inline void require_unused(const Use& wanted, const char* name) {
  for (const Use& use : Use::all()) {
    const bool is_conflict = use.access == Access::change ||
                             (use.access == Access::read && wanted.access == Access::change);
    if (is_conflict && use.overlaps(wanted)) {
      throw std::runtime_error(std::string("this ") + name +
                               " is in use by a call in another thread: wait for its end");
    }
  }
}

/// Releases the GIL like pybind11's gil_scoped_release, but is safe at the end of the interpreter.
/// Before 3.14, Python then ends threads that request the GIL by unwinding their stacks, which
/// calls std::terminate in frames of C++. Here such a thread waits for the end of the process
/// instead.
class ReleasedGIL {
 public:
  ReleasedGIL() : state_(PyEval_SaveThread()) {}
  ReleasedGIL(const ReleasedGIL&) = delete;
  ReleasedGIL& operator=(const ReleasedGIL&) = delete;
  ~ReleasedGIL() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    }
  }

 private:
  PyThreadState* state_;
};

/// Lists uses during its lifetime. The GIL must be held at its begin and at its end.
class ListedUses {
 public:
  ListedUses(const void* owner, const std::vector<Use>& uses) : owner_(owner) {
    Use::all().insert(Use::all().end(), uses.begin(), uses.end());
  }
  ListedUses(const ListedUses&) = delete;
  ListedUses& operator=(const ListedUses&) = delete;
  ~ListedUses() {
    std::erase_if(Use::all(), [this](const Use& use) { return use.owner == owner_; });
  }

 private:
  const void* owner_;
};

/// Releases the GIL while a call works on objects, so that other threads can run Python.
///
/// Objects passed as const are read, others are changed, including everything stored in them.
/// During its lifetime any use of a changing object, and any change of an object that is being
/// read, raises a RuntimeError; calls that should wait instead begin with wait_for_readers or
/// wait_for_changes. Arrays must be copied before: nothing prevents other threads from changing
/// them.
class WithoutGIL {
 public:
  /// Lists the uses of the objects. Throws std::runtime_error if a call in another thread is
  /// changing an object, or is reading an object that this call will change.
  template <class... Object>
  explicit WithoutGIL(Object&... objects) : uses_(this, checked({Use::of(this, objects)...})) {}
  /// Does the same for objects and parts (memory outside the objects) whose number is known only at
  /// run time.
  template <class Object, class Part>
  WithoutGIL(const std::vector<Object*>& objects, const std::vector<std::span<Part>>& parts)
      : uses_(this, checked(of_all(objects, parts))) {}
  WithoutGIL(const WithoutGIL&) = delete;
  WithoutGIL& operator=(const WithoutGIL&) = delete;

 private:
  /// Describes the uses of objects, and of parts that lie outside them.
  template <class Object, class Part>
  std::vector<Use> of_all(const std::vector<Object*>& objects,
                          const std::vector<std::span<Part>>& parts) const {
    std::vector<Use> uses;
    for (Object* const object : objects) uses.push_back(Use::of(this, *object));
    for (const std::span<Part>& part : parts) uses.push_back(Use::of(this, part));
    return uses;
  }

  /// Returns the uses if no other call conflicts with them; see require_unused.
  static std::vector<Use> checked(std::vector<Use> uses) {
    for (const Use& use : uses) require_unused(use, "object");
    return uses;
  }

  ListedUses uses_;
  ReleasedGIL released_;  // last: the GIL is back before the list changes
};

/// Lets other threads run until no listed use satisfies `is_in_the_way`. Ctrl-C ends the wait with
/// the exception of Python's signal handler.
template <class Condition>
void wait_while_any(const Condition& is_in_the_way) {
  while (std::ranges::any_of(Use::all(), is_in_the_way)) {
    {
      const ReleasedGIL released;
      std::this_thread::yield();
    }
    core::interruption_point();
  }
}

/// Waits until no call reads the object, so that it can be changed with the GIL
/// held. Meanwhile calls that begin with wait_for_changes do not begin to read: readers without
/// pause cannot keep a change from its turn. Use it only for objects that are read for short times.
template <class Object>
void wait_for_readers(Object& object) {
  Use use = Use::of(&use, object);
  const auto is_reader = [&use](const Use& other) {
    return other.access == Access::read && other.overlaps(use);
  };
  if (std::ranges::none_of(Use::all(), is_reader)) return;
  use.access = Access::wait_to_change;
  const ListedUses pending(&use, {use});
  wait_while_any(is_reader);
}

/// Waits until other threads' pending and running changes of the objects are done. Every call that
/// reads, without the GIL, objects of wait_for_readers begins with it, as it may find the objects
/// changed afterwards. A thread that already reads, or waits for readers (it runs a signal
/// handler), does not wait: the pending change may be waiting for that thread, or be its own.
template <class... Object>
void wait_for_changes(const Object&... objects) {
  const auto is_of_this_thread = [](const Use& use) {
    return use.thread == std::this_thread::get_id();
  };
  if (std::ranges::any_of(Use::all(), is_of_this_thread)) return;
  const Use uses[] = {Use::of(nullptr, objects)...};
  wait_while_any([&uses](const Use& other) {
    const auto overlaps = [&other](const Use& use) { return use.overlaps(other); };
    return other.access != Access::read && std::ranges::any_of(uses, overlaps);
  });
}

/// Makes pickling raise TypeError for all classes that do not define it. Otherwise, with pickle's
/// protocols 0 and 1, pybind11 would throw a C++ exception through Python's frames.
inline void refuse_pickling() {
  const pybind11::handle base(pybind11::detail::get_internals().instance_base);
  base.attr("__reduce__") = pybind11::cpp_function(
      [](pybind11::handle self) {
        throw pybind11::type_error("cannot pickle a " + std::string(Py_TYPE(self.ptr())->tp_name));
      },
      pybind11::is_method(base));
}

/// Throws TypeError if the object of `held` was never initialized, and std::runtime_error if
/// another thread's call is changing it. pybind11 checks neither: it would allocate uninitialized
/// memory for the former.
inline void require_usable(const pybind11::detail::value_and_holder& held) {
  const auto name = [&held] {
    const pybind11::handle type(reinterpret_cast<PyObject*>(Py_TYPE(held.inst)));
    return pybind11::cast<std::string>(type.attr("__name__"));
  };
  const auto* const object = static_cast<const std::byte*>(held.value_ptr());
  if (object == nullptr) throw pybind11::type_error(name() + ".__init__() was not called");
  if (!Use::all().empty()) {
    require_unused({nullptr, object, object + 1, Access::read}, name().c_str());
  }
}

}  // namespace sdnn::bindings

namespace pybind11::detail {

/// Arguments of the library's classes, `self` among them.
template <sdnn::bindings::LibraryClass T>
class type_caster<T> : public type_caster_base<T> {
 public:
  bool load(handle source, bool convert) {
    return this->template load_impl<type_caster>(source, convert);
  }
  void load_value(value_and_holder&& held) {
    sdnn::bindings::require_usable(held);
    type_caster_base<T>::load_value(std::move(held));
  }
};

template <sdnn::bindings::LibraryClass T>
class type_caster<std::shared_ptr<T>> : public copyable_holder_caster<T, std::shared_ptr<T>> {
 public:
  bool load(handle source, bool convert) {
    if (source.is_none()) return false;  // no function takes a null pointer
    return this->template load_impl<type_caster>(source, convert);
  }

 private:
  friend class type_caster_generic;
  void load_value(value_and_holder&& held) {
    sdnn::bindings::require_usable(held);
    copyable_holder_caster<T, std::shared_ptr<T>>::load_value(std::move(held));
  }
};

}  // namespace pybind11::detail
