#include "simulation.hpp"

#include "case.hpp"
#include "checks.hpp"
#include "exports.hpp"
#include "io/build.hpp"
#include "io/history.hpp"
#include "io/observers.hpp"
#include "io/progress.hpp"
#include "io/vtk.hpp"
#include "material/outside_law.hpp"
#include "method/courant.hpp"
#include "method/diagnostics.hpp"
#include "method/energy_account.hpp"
#include "method/place.hpp"
#include "setup/time_step.hpp"
#include "sim/output_fields.hpp"
#include "sim/simulation.hpp"
#include "threads.hpp"
#include "whole_steps.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <thread>

#include <unistd.h>

namespace ordo::python {

namespace {

using Path = std::filesystem::path;

/// What `run` was told.
struct RunOptions {
    std::optional<double> until;  ///< s
    std::optional<Path> output;
    bool has_progress = false, overwrites = false;
};

/// The door to a simulation: every call from Python comes through `enter`, which keeps others out while it lasts.
class Door {
  public:
    virtual ~Door() = default;

    virtual int dim() const                              = 0;
    virtual double t() const                             = 0;
    virtual double dt() const                            = 0;
    virtual long n() const                               = 0;
    virtual int count() const                            = 0;
    virtual bool is_complete() const                     = 0;
    virtual std::vector<std::string> state_names() const = 0;
    virtual std::vector<std::string> notes() const       = 0;
    virtual py::array particles(const std::string& name) = 0;
    virtual py::array field(const std::string& name)     = 0;
    /// Sets the nodes if particles were changed. Returns whether it did, which ends the time of views.
    virtual bool find_nodes()                        = 0;
    virtual void require_idle()                      = 0;
    virtual py::dict grid()                          = 0;
    virtual py::dict history()                       = 0;
    virtual void step(std::optional<double> dt)      = 0;
    virtual void run(const RunOptions& options)      = 0;
    virtual void save(const Path& file)              = 0;
    virtual void restore(const Path& file)           = 0;
    virtual void write(const Path& file)             = 0;
    virtual void set_body_force(const py::object& f) = 0;
    virtual void set_on_nodes(const py::object& f)   = 0;
    virtual void set_on_step(const py::object& f)    = 0;
    virtual std::vector<std::string> take_warnings() = 0;
};

constexpr auto kBetweenSignals = std::chrono::milliseconds(50);

template <int D>
class DoorOf final : public Door, private Observer<D> {
  public:
    DoorOf(const io::CaseInput& input, int threads) : input_(input), threads_(threads)
    {
        with_threads(threads_, [&] {
            sim_.emplace(io::build<D>(input_), input_.watch_spec,
                         [this](const std::string& found) { warnings_.push_back(found); });
            sim_->scheme().project(state());  // for the first row
            state().projection.is_wanted = true;
            history_.emplace(input_, sim_->model());
            probes_ = io::probe_particles(input_, state());
            add_row();
        });
        exports_.emplace(state().particles, stress_rows_);
        seen_.emplace(state().particles);
        if (const Instability* found = instability_of(sim_->model().method))
            warnings_.push_back(
                "with this method short waves grow, at any time step, once particles have left sub-cell centres: " +
                std::string(found->why));
        sim_->add(*this);
    }
    ~DoorOf() override
    {
        if (exports_) exports_->for_each([](auto& one) { one.leave(); });
    }

    int dim() const override { return D; }
    double t() const override { return sim_->state().t; }
    double dt() const override { return sim_->state().dt_prev; }
    long n() const override { return sim_->state().n; }
    int count() const override { return sim_->state().particles.count; }
    bool is_complete() const override { return sim_->is_complete(); }
    std::vector<std::string> notes() const override { return sim_->notes(); }
    std::vector<std::string> state_names() const override { return sim_->state().particles.history_names; }
    std::vector<std::string> take_warnings() override { return std::exchange(warnings_, {}); }

    py::array particles(const std::string& name) override
    {
        const Inside inside(*this);
        Particles<D>& p            = state().particles;
        const py::ssize_t n        = p.count;
        constexpr py::ssize_t real = sizeof(double);
        const bool has_own_places  = !has_cells(sim_->model().method);
        Exports& out               = *exports_;
        auto vectors               = [&](Export<Vec<D>>& of, bool is_writable) {
            return of.template numpy<double>({n, D}, {D * real, real}, is_writable);
        };
        auto numbers = [&](Export<double>& of, bool is_writable) { return of.template numpy<double>({n}, {real}, is_writable); };
        auto whole   = [&](Export<std::int32_t>& of) {
            return of.template numpy<std::int32_t>({n}, {sizeof(std::int32_t)}, false);
        };
        if (name == "x") {
            seen_->x.see();
            return vectors(out.x, has_own_places);
        }
        if (name == "v") {
            seen_->v.see();
            return vectors(out.v, true);
        }
        if (name == "X") return vectors(out.X, false);
        if (name == "F") return out.F.template numpy<double>({n, D, D}, {D * D * real, D * real, real}, false);
        if (name == "stress") {
            if (!stress_shown_) show_stress();
            return out.stress.template numpy<double>({n, D, D}, {D * D * real, D * real, real}, true);
        }
        if (name == "V") return numbers(out.V, false);
        if (name == "mass") return numbers(out.m, false);
        if (name == "body") return whole(out.body);
        if (name == "material") return whole(out.material);
        if (name == "id") return whole(out.id);
        const int column = p.history_column(name);
        if (column < 0) throw py::attribute_error("particles have no " + name);
        seen_->columns[static_cast<std::size_t>(column)].see();
        return numbers(out.columns[static_cast<std::size_t>(column)], name != OutsideLaw::kWork.name);
    }

    py::array field(const std::string& name) override
    {
        const Inside inside(*this);
        settle();
        const bool is_carried = state().particles.history_column(name) >= 0;
        if (!is_carried && !is_computed_field(name)) {
            std::vector<std::string> names = state_names();
            for (const OutputFieldText& f : output_fields())
                if (is_computed_field(f.name)) names.push_back(f.name);
            throw InputError("field \"" + name + "\": particles have no such field. " + io::suggestion(name, names));
        }
        const FieldReader<D> read(name, sim_->model(), state().particles);
        const auto components = static_cast<std::size_t>(read.components());
        std::vector<py::ssize_t> shape{count()};
        if (components == 3) shape.push_back(3);
        if (components == 9) shape.insert(shape.end(), {3, 3});
        py::array_t<double> r(shape);
        double* const out = r.mutable_data();
        for (int i = 0; i < count(); ++i) read(i, out + static_cast<std::size_t>(i) * components);
        return r;
    }

    bool find_nodes() override
    {
        const Inside inside(*this);
        settle();
        if (has_nodes_) return false;
        require_good("grid");
        release();  // a projection may sort the particles
        in_pool([&] { sim_->scheme().project(state()); });
        return has_nodes_ = true;
    }

    py::dict grid() override
    {
        const Inside inside(*this);
        py::dict r;
        const NodeList<D> nodes = state().field.nodes.empty() ? NodeList<D>{} : nodes_with_mass(state());
        std::vector<Vec<D>> v;
        for (const std::ptrdiff_t node : nodes.record) {
            const Lanes& record = state().field.nodes[static_cast<std::size_t>(node)];
            for (int a = 0; a < D; ++a) (a == 0 ? v.emplace_back() : v.back())[a] = record[NodeLane::velocity + a];
        }
        r["place"]    = rows(nodes.place);
        r["velocity"] = rows(v);
        r["mass"]     = py::array_t<double>(static_cast<py::ssize_t>(nodes.mass.size()), nodes.mass.data());
        r["field"]    = py::array_t<int>(static_cast<py::ssize_t>(nodes.field.size()), nodes.field.data());
        return r;
    }

    py::dict history() override
    {
        const Inside inside(*this);
        if (is_row_due_) add_row();
        const std::size_t columns = history_->columns().size(), rows = rows_.size() / columns;
        py::dict r;
        for (std::size_t c = 0; c < columns; ++c) {
            py::array_t<double> column(static_cast<py::ssize_t>(rows));
            double* const out = column.mutable_data();
            for (std::size_t k = 0; k < rows; ++k) out[k] = rows_[k * columns + c];
            r[history_->columns()[c].c_str()] = column;
        }
        return r;
    }

    void step(std::optional<double> dt) override
    {
        const Running running(*this);
        if (dt && !(*dt > 0 && std::isfinite(*dt))) throw InputError("step: dt must be positive and finite");
        if (!sim_->stages().empty() && sim_->is_complete()) throw InputError("step: the last stage of the case has ended");
        go_on([&] { sim_->step_on(dt); });
    }

    void run(const RunOptions& options) override
    {
        const Running running(*this);
        const double end = options.until.value_or(sim_->time().end);
        if (options.output && options.output->empty()) throw InputError("run: output must not be empty; give a folder");
        if (!std::isfinite(end)) throw InputError("run: until must be a finite time, s");
        if (options.until && end < t())
            throw InputError(fmt::format("run: until = {:.6g} s lies before the present, {:.6g} s", end, t()));
        go_on([&] {
            std::optional<Files> files;
            if (options.output) files.emplace(*this, options);
            io::Progress line(!options.has_progress, t(), end);
            files_    = files ? &*files : nullptr;
            progress_ = &line;
            const Reset reset{*this};
            if (files_) files_->writer.started(*sim_);
            try {
                sim_->advance(end, [&] { return is_stopped_.load(); });
            } catch (const NumericalError&) {  // `failed` has written the last frame
                throw;
            } catch (...) {
                if (files_ && in_step_) files_->writer.failed(*sim_, NumericalError(""));
                throw;
            }
            add_row();
            if (files_) files_->end(*sim_);
            line.done(n(), t());
        });
    }

    void save(const Path& file) override
    {
        const Inside inside(*this);
        require_good("save");
        settle();
        io::Written w;
        w.step  = n();
        w.stage = state().stage;
        w.watched.assign(sim_->watch()->energies().begin(), sim_->watch()->energies().end());
        w.probe_particles = probes_;
        in_pool([&] { io::save_state(file, input_, *sim_, w); });
    }

    void restore(const Path& file) override
    {
        const Inside inside(*this);
        in_pool([&] {
            const io::Written w = io::restore_state(file, input_, *sim_);
            sim_->watch()->resume(w.watched, state());
            probes_ = w.probe_particles;
            rows_.clear();
            last_row_  = -1;
            has_nodes_ = false;
        });
    }

    void write(const Path& file) override
    {
        const Inside inside(*this);
        settle();
        Path named = file;
        if (named.extension() != ".vtu") named += ".vtu";
        if (named.has_parent_path()) std::filesystem::create_directories(named.parent_path());
        in_pool([&] { io::write_particles(named, sim_->model(), state(), io::style_of(input_.output)); });
    }

    void set_body_force(const py::object& f) override
    {
        const Inside inside(*this);
        settle();
        if (f.is_none()) return sim_->scheme().add_body_force({}, state());
        auto force = [this, f](const ParticleView<D>& p, double t) {
            const py::gil_scoped_acquire gil;
            const py::ssize_t n = p.count;
            std::vector<Vec<D>> x(static_cast<std::size_t>(n));
            for (int i = 0; i < p.count; ++i)
                x[static_cast<std::size_t>(i)] = place_in_period(sim_->model(), state().particles, i);
            const py::object given = f(rows(x), py::array_t<double>(std::vector<py::ssize_t>{n, D}, p.X->c), t);
            const Numbers b        = numbers_of("body_force", "the acceleration", given, {n, D});
            for (int i = 0; i < p.count; ++i)
                for (int a = 0; a < D; ++a) {
                    const double one = b.data()[i * D + a];
                    if (!std::isfinite(one))
                        throw NumericalError(
                            fmt::format("body_force: the acceleration of particle {} of body {} at {} is not finite", p.id[i],
                                        p.body[i], place_text(x[static_cast<std::size_t>(i)])));
                    p.b[i][a] += one;
                }
        };
        sim_->scheme().add_body_force(force, state());
    }

    void set_on_nodes(const py::object& f) override
    {
        const Inside inside(*this);
        if (f.is_none()) return sim_->scheme().on_nodes({});
        sim_->scheme().on_nodes([f](NodeForces<D>& now) {
            const py::gil_scoped_acquire gil;
            const auto m                       = static_cast<py::ssize_t>(now.nodes.mass.size());
            const py::array_t<double> momentum = rows(now.momentum), force = rows(now.force);
            const py::object nodes =
                py::module_::import("ordo._views")
                    .attr("Nodes")(now.t, now.dt, rows(now.nodes.place), py::array_t<double>(m, now.nodes.mass.data()), momentum,
                                   force, py::array_t<int>(m, now.nodes.field.data()));
            f(nodes);
            auto take = [&](const char* what, std::vector<Vec<D>>& to) {
                const Numbers numbers = numbers_of("on_nodes", what, nodes.attr(what), {m, D});
                if (m > 0) std::copy_n(numbers.data(), numbers.size(), to.data()->c);
            };
            take("momentum", now.momentum);
            take("force", now.force);
        });
    }

    void set_on_step(const py::object& f) override
    {
        const Inside inside(*this);
        on_step_ = f;
    }

  private:
    // ---- who may come in -----------------------------------------------------------------------------------------------------

    /// A call that looks: while nothing runs, or from a callback after a step; one at a time, because some leave the interpreter to others.
    class Inside {
      public:
        explicit Inside(DoorOf& of) : of_(of)
        {
            of.require_own_process();
            if (of.is_inside_ || (of.is_running_ && std::this_thread::get_id() != of.visitor_))
                throw std::runtime_error("the simulation is in use, by another thread or by the call that this callback is part "
                                         "of; wait until it returns");
            of.is_inside_ = true;
        }
        ~Inside() { of_.is_inside_ = false; }
        Inside(const Inside&) = delete;

      private:
        DoorOf& of_;
    };

    /// A call that steps.
    class Running {
      public:
        explicit Running(DoorOf& of) : of_(of)
        {
            of.require_idle();
            of.require_good("step");
            of.is_running_ = true;
        }
        ~Running() { of_.is_running_ = false; }
        Running(const Running&) = delete;

      private:
        DoorOf& of_;
    };

    void require_idle() override
    {
        require_own_process();
        if (is_running_ || is_inside_)
            throw std::runtime_error(
                "the simulation is in use already; callbacks cannot step it, nor can other threads meanwhile");
    }
    void require_own_process() const
    {
        if (getpid() != process_)
            throw std::runtime_error(
                "this simulation belongs to the process that made it, before a fork; make a new one in each process");
    }
    void require_good(const char* what) const
    {
        if (!spoiled_.empty())
            throw NumericalError(
                fmt::format("{}: an earlier step failed and its state is not good: {}; begin anew, or restore a saved state",
                            what, spoiled_));
    }

    /// f() without the GIL, on the threads of the simulation.
    void in_pool(const std::function<void()>& f)
    {
        const py::gil_scoped_release release;
        with_threads(threads_, f);
    }

    /// f() takes steps. What callbacks threw after whole steps is thrown when it has ended; what breaks a step spoils the state.
    void go_on(const std::function<void()>& f)
    {
        is_stopped_ = false;
        in_step_    = false;
        pending_    = nullptr;
        release();
        WholeSteps whole_steps;
        whole_steps_ = &whole_steps;
        try {
            in_pool(f);
        } catch (const std::exception& e) {
            whole_steps_ = nullptr;
            pending_     = nullptr;
            if (in_step_ || dynamic_cast<const NumericalError*>(&e)) spoil(e.what());
            throw;
        }
        whole_steps_ = nullptr;
        if (pending_) std::rethrow_exception(std::exchange(pending_, nullptr));
        if (!whole_steps.take()) return;  // else it came after the last step
        PyErr_SetNone(PyExc_KeyboardInterrupt);
        throw py::error_already_set();
    }

    void spoil(const std::string& why) { spoiled_ = why.substr(0, why.find('\n')); }

    // ---- after each step -----------------------------------------------------------------------------------------------------

    void before_step(Simulation<D>& sim, const StepSize& size) override
    {
        if (files_) files_->keep.before_step(sim, size);
        in_step_ = true;
    }
    void after_step(Simulation<D>& sim, const StepSize& size) override
    {
        in_step_    = false;
        has_nodes_  = true;
        is_row_due_ = n() % input_.output.history_interval == 0 || sim.is_stage_over();
        call_python();  // first: files and checkpoints have what it changes
        if (files_) {
            files_->writer.after_step(sim, size);
            files_->keep.after_step(sim, size);
        }
        if (is_row_due_) add_row();
        if (progress_) progress_->show(n(), t(), size.dt);
    }
    /// The user's function, Ctrl-C, and other signals now and then.
    void call_python()
    {
        const auto now         = std::chrono::steady_clock::now();
        const bool is_time     = now - last_signals_ >= kBetweenSignals;
        const bool has_on_step = on_step_ && !on_step_.is_none();
        if (!has_on_step && !is_time && !whole_steps_->is_interrupted()) return;
        const py::gil_scoped_acquire gil;
        if (has_on_step) call_on_step();
        if (pending_) return;
        if (whole_steps_->take()) {
            PyErr_SetNone(PyExc_KeyboardInterrupt);
            return stop(std::make_exception_ptr(py::error_already_set()));
        }
        if (!is_time) return;
        last_signals_ = now;
        if (PyErr_CheckSignals() != 0) stop(std::make_exception_ptr(py::error_already_set()));
    }
    void call_on_step()
    {
        visitor_ = std::this_thread::get_id();
        try {
            const py::object f = on_step_, answer = f();
            is_stopped_ = is_stopped_ || (py::isinstance<py::bool_>(answer) && !answer.cast<bool>());
        } catch (...) {
            stop(std::current_exception());
        }
        visitor_ = {};
        for (bool is_settled = false; !is_settled;) {  // what cannot stay is put back, one field after the other
            try {
                release();
                is_settled = true;
            } catch (...) {
                if (!pending_) stop(std::current_exception());
            }
        }
    }
    void failed(Simulation<D>& sim, const NumericalError& e) override
    {
        if (files_) files_->writer.failed(sim, e);
    }

    /// Ends the run after this step with an error.
    void stop(std::exception_ptr error)
    {
        pending_    = std::move(error);
        is_stopped_ = true;
    }

    void add_row()
    {
        is_row_due_ = false;
        if (last_row_ == n()) return;
        last_row_                          = n();
        const std::vector<double>* written = files_ ? files_->writer.row_of(state()) : nullptr;
        const std::vector<double> row      = written ? *written : history_->row(state());
        rows_.insert(rows_.end(), row.begin(), row.end());
    }

    /// The files of a run, from its start to its end.
    struct Files {
        Files(DoorOf& door, const RunOptions& options)
            : input(with_directory(door.input_, *options.output)),
              directory(input.output, options.overwrites ? io::Earlier::overwrite : io::Earlier::refuse),
              checkpoints(input, door.sim_->model(), directory),
              writer(input, door.sim_->model(), directory, *door.state().ranks, door.probes_),
              keep(checkpoints, writer, [&door] { return door.is_stopped_.load(); })
        {}
        static io::CaseInput with_directory(io::CaseInput input, const Path& path)
        {
            input.output.directory       = path.string();
            input.output.at["directory"] = {"output", 0, 0};
            io::require_usable(input.output, io::Earlier::go_on);
            return input;
        }
        void end(Simulation<D>& sim)
        {
            keep.ending(sim);
            writer.ended(sim);
            keep.ended(sim);
        }

        io::CaseInput input;
        io::RunDirectory directory;
        io::Checkpoints<D> checkpoints;
        io::Writer<D> writer;
        io::KeepCheckpoints<D> keep;
    };
    struct Reset {
        DoorOf& of;
        ~Reset()
        {
            of.files_    = nullptr;
            of.progress_ = nullptr;
        }
    };

    // ---- what numpy sees and changes --------------------------------------------------------------------------------------------

    /// A field that numpy may have changed, and what it was.
    template <class T>
    struct SeenField {
        Array<T>* now;
        Array<T> before{};
        bool is_seen = false;

        void see()
        {
            if (!std::exchange(is_seen, true)) ordo::copy(before, *now);
        }
        bool differs() const { return is_seen && std::memcmp(now->data(), before.data(), now->size() * sizeof(T)) != 0; }
        void put_back() { ordo::copy(*now, before); }
    };
    struct Seen {
        explicit Seen(Particles<D>& p) : x{&p.x}, v{&p.v}
        {
            for (Array<double>& column : p.history) columns.push_back({&column});
        }
        template <class Use>
        void for_each(const Use& use)
        {
            use(x);
            use(v);
            for (SeenField<double>& column : columns) use(column);
        }
        /// What was and what is.
        void swap()
        {
            for_each([](auto& one) {
                if (one.is_seen) std::swap(*one.now, one.before);
            });
        }
        void see_again()
        {
            for_each([](auto& one) {
                if (one.is_seen) ordo::copy(one.before, *one.now);
            });
        }
        void forget()
        {
            for_each([](auto& one) { one.is_seen = false; });
        }
        SeenField<Vec<D>> x, v;
        std::vector<SeenField<double>> columns;
    };

    State<D>& state() { return sim_->state(); }

    static py::array_t<double> rows(const std::vector<Vec<D>>& v)
    {
        return py::array_t<double>(std::vector<py::ssize_t>{static_cast<py::ssize_t>(v.size()), D},
                                   v.empty() ? nullptr : v.data()->c);
    }

    void show_stress()
    {
        const Particles<D>& p = state().particles;
        if (stress_rows_.size() != p.sigma.size()) stress_rows_ = Array<Mat<D>>(p.sigma.size());  // else numpy may see it
        for (int i = 0; i < p.count; ++i)
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) stress_rows_[i](a, b) = p.sigma[i](a, b);
        stress_shown_ = true;
    }

    /// Takes over what numpy has changed, with all that follows from it. Throws InputError for what cannot stay, which is then as it was.
    void settle()
    {
        Particles<D>& p = state().particles;
        Seen& seen      = *seen_;
        require_finite("v", seen.v);
        require_finite("x", seen.x);
        for (std::size_t k = 0; k < seen.columns.size(); ++k) require_finite(p.history_names[k], seen.columns[k]);
        const bool moved = seen.x.differs(), kicked = seen.v.differs();
        if (moved) require_in_grid();
        const bool pressed = has_stress_changed();
        bool carried       = false;
        for (const auto& column : seen.columns) carried = carried || column.differs();
        if (!moved && !kicked && !pressed && !carried) return;
        // What was changed is neither gained nor lost by the method.
        seen.swap();
        const EnergyParts before = energies();
        seen.swap();
        if (pressed) take_stress();
        if (kicked) follow_velocities();
        const EnergyParts added = energies() - before;
        state().account.start += added;
        state().account.staged -= added.all();
        if (moved) {
            state().drift               = std::numeric_limits<double>::infinity();  // sort before the next step
            state().has_external_forces = false;
        }
        seen.see_again();
        has_nodes_ = false;
    }

    EnergyParts energies()
    {
        EnergyParts r;
        with_threads(threads_, [&] { r = energy_parts(totals(sim_->model(), state())); });
        return r;
    }

    /// What particles and corners carry besides their velocities gets the same changes. A corner takes the mean of its cells.
    void follow_velocities()
    {
        Particles<D>& p = state().particles;
        for (int i = 0; i < p.count && !p.modes.empty(); ++i) p.modes[i].c[0] += p.v[i] - seen_->v.before[i];
        if (p.corner_velocity.empty()) return;
        std::vector<Vec<D>> sum(p.corner_velocity.size());
        std::vector<int> cells(sum.size());
        for (int i = 0; i < p.count; ++i)
            for (int c = 0; c < p.cell[i].count(); ++c) {
                const auto corner = static_cast<std::size_t>(p.cell[i][c]);
                sum[corner] += p.v[i] - seen_->v.before[i];
                ++cells[corner];
            }
        for (std::size_t c = 0; c < sum.size(); ++c)
            if (cells[c] > 0) p.corner_velocity[c] += (1.0 / cells[c]) * sum[c];
    }

    /// Throws InputError if they are no stresses, and shows the old ones again.
    bool has_stress_changed()
    {
        Particles<D>& p = state().particles;
        bool is_changed = false;
        for (int i = 0; i < p.count && stress_shown_; ++i) {
            const Mat<D>& now = stress_rows_[i];
            for (int a = 0; a < D; ++a)
                for (int b = a; b < D; ++b) {
                    if (now(a, b) == p.sigma[i](a, b) && now(b, a) == p.sigma[i](a, b)) continue;
                    is_changed = true;
                    if (std::isfinite(now(a, b)) && now(a, b) == now(b, a)) continue;
                    const char* const fault = std::isfinite(now(a, b)) ? "symmetric" : "finite";
                    show_stress();
                    throw InputError(
                        fmt::format("stress of particle {} of body {} at {} is not {}; all stresses are as they were", p.id[i],
                                    p.body[i], place_text(p.x[i]), fault));
                }
        }
        return is_changed;
    }
    void take_stress()
    {
        Particles<D>& p = state().particles;
        for (int i = 0; i < p.count; ++i)
            for (int a = 0; a < D; ++a)
                for (int b = a; b < D; ++b) p.sigma[i](a, b) = stress_rows_[i](a, b);
    }

    template <class T>
    void require_finite(const std::string& name, SeenField<T>& field)
    {
        const Particles<D>& p = state().particles;
        auto is_finite        = [](const T& value) {
            if constexpr (std::is_same_v<T, double>) {
                return std::isfinite(value);
            } else {
                return std::all_of(value.c, value.c + D, [](double one) { return std::isfinite(one); });
            }
        };
        for (int i = 0; i < p.count && field.is_seen; ++i) {
            if (is_finite((*field.now)[i])) continue;
            field.put_back();
            throw InputError(fmt::format("{} of particle {} of body {} is not finite; all {} are as they were", name, p.id[i],
                                         p.body[i], name));
        }
    }
    void require_in_grid()
    {
        const Particles<D>& p = state().particles;
        const Model<D>& model = sim_->model();
        for (int i = 0; i < p.count; ++i)
            for (int a = 0; a < D; ++a) {
                if (model.periodic[a] ? std::fabs(p.x[i][a] - seen_->x.before[i][a]) < model.cells[a] * model.h[a]
                                      : p.x[i][a] >= model.face(a, false) && p.x[i][a] <= model.face(a, true))
                    continue;
                const std::string at = place_text(p.x[i]);
                seen_->x.put_back();
                throw InputError(fmt::format("x of particle {} of body {} at {} is outside the grid; all x are as they were",
                                             p.id[i], p.body[i], at));
            }
    }

    /// Before the state changes: takes over what numpy has changed, and leaves it the memory that it still sees.
    void release()
    {
        settle();
        seen_->forget();
        stress_shown_ = false;
        exports_->for_each([](auto& one) { one.release(); });
    }

    io::CaseInput input_;
    int threads_;
    const pid_t process_ = getpid();
    std::vector<std::string> warnings_;
    std::optional<Simulation<D>> sim_;
    std::optional<io::History<D>> history_;
    std::vector<double> rows_;
    long last_row_ = -1;

    std::atomic<bool> is_running_ = false, is_stopped_ = false;
    bool is_inside_ = false, in_step_ = false, has_nodes_ = true, is_row_due_ = false;
    std::vector<std::int32_t> probes_;  ///< the particles of [[probe]]
    std::string spoiled_;               ///< why the state is not good
    std::exception_ptr pending_;
    std::thread::id visitor_{};          ///< that may look while the simulation runs
    WholeSteps* whole_steps_ = nullptr;  ///< of the call that steps
    std::chrono::steady_clock::time_point last_signals_{};
    py::object on_step_;
    Files* files_           = nullptr;
    io::Progress* progress_ = nullptr;

    Array<Mat<D>> stress_rows_;  ///< what numpy sees of the stress, which is symmetric in memory
    bool stress_shown_ = false;
    std::optional<Seen> seen_;

    /// Of the fields of particles.
    struct Exports {
        explicit Exports(Particles<D>& p, Array<Mat<D>>& stress_rows)
            : x(p.x), X(p.X), v(p.v), F(p.F), stress(stress_rows), V(p.V), m(p.m), body(p.body), material(p.material), id(p.id)
        {
            for (Array<double>& column : p.history) columns.emplace_back(column);
        }
        template <class Use>
        void for_each(const Use& use)
        {
            for (Export<Vec<D>>* one : {&x, &X, &v}) use(*one);
            for (Export<Mat<D>>* one : {&F, &stress}) use(*one);
            for (Export<double>* one : {&V, &m}) use(*one);
            for (Export<std::int32_t>* one : {&body, &material, &id}) use(*one);
            for (Export<double>& one : columns) use(one);
        }
        Export<Vec<D>> x, X, v;
        Export<Mat<D>> F, stress;
        Export<double> V, m;
        Export<std::int32_t> body, material, id;
        std::vector<Export<double>> columns;
    };
    std::optional<Exports> exports_;
};

std::unique_ptr<Door> make_door(const io::CaseInput& input, std::optional<int> threads)
{
    const int count = threads_of(threads);
    switch (input.grid.dim) {
    case 1: return std::make_unique<DoorOf<1>>(input, count);
    case 2: return std::make_unique<DoorOf<2>>(input, count);
    default: return std::make_unique<DoorOf<3>>(input, count);
    }
}

}  // namespace

void add_simulation(py::module_& module)
{
    threads_of({});  // now: later the caller may have changed the number, or have forked
    py::class_<Door>(module, "Simulation")
        .def(py::init([](const CaseOf& of, std::optional<int> threads) { return make_door(of.input, threads); }), py::arg("case"),
             py::arg("threads"))
        .def_static(
            "restore",
            [](const Path& file, const CaseOf* of, std::optional<int> threads) {
                std::unique_ptr<Door> door = make_door(of ? of->input : io::case_of_checkpoint(file), threads);
                door->restore(file);
                return door;
            },
            py::arg("file"), py::arg("case"), py::arg("threads"))
        .def_property_readonly("dim", &Door::dim)
        .def_property_readonly("t", &Door::t)
        .def_property_readonly("dt", &Door::dt)
        .def_property_readonly("n", &Door::n)
        .def_property_readonly("count", &Door::count)
        .def_property_readonly("is_complete", &Door::is_complete)
        .def_property_readonly("notes", &Door::notes)
        .def("state_names", &Door::state_names)
        .def("take_warnings", &Door::take_warnings)
        .def("particles", &Door::particles)
        .def("field", &Door::field)
        .def("find_nodes", &Door::find_nodes)
        .def("require_idle", &Door::require_idle)
        .def("grid", &Door::grid)
        .def("history", &Door::history)
        .def("step", &Door::step, py::arg("dt"))
        .def(
            "run",
            [](Door& door, std::optional<double> until, std::optional<Path> output, bool progress, bool overwrite) {
                door.run({until, std::move(output), progress, overwrite});
            },
            py::arg("until"), py::arg("output"), py::arg("progress"), py::arg("overwrite"))
        .def("save", &Door::save)
        .def("write", &Door::write)
        .def("set_body_force", &Door::set_body_force)
        .def("set_on_nodes", &Door::set_on_nodes)
        .def("set_on_step", &Door::set_on_step);
}

}  // namespace ordo::python
