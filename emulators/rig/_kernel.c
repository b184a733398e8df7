/* The short ways of a sound CAN bus and of its stations, in C.

   Theory of operation. The fields of stations, timetable, ends, arbiter and segment lie in the
   structs below, as attributes that Python code reads and writes like slots: there is one state,
   never a copy of it. So each function here can hand over to its Python method at any moment, and
   does so wherever anything is not of the plain kind: a fault, an error counter, two nodes with one
   identifier, a full queue, a frame that is none. What is here does what the Python method of the
   same name does; that one is the reference, and `enable(False)` leaves everything to it.

   `CanSegment._sound` is True while every frame is delivered and nothing is counted. Python sets it
   to False wherever that may end; planning asks `CanSegment._is_sound` before it takes a short way.

   Nothing that comes over a wire is trusted: `read_frame` takes a tuple of five with an identifier,
   lengths and flags in their ranges, or refuses it, and Python decides what becomes of it. Any
   callback may run any code: whatever is used after one is held by a reference, and looked up anew
   where it could have been replaced.

   Fields of a struct are eight bytes each, objects first: pickle compares their number with the
   size of the object, and `base_traverse` and `base_clear` need the number of objects alone. */

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <stdint.h>
#include <structmember.h>

#define NEVER ((1LL << 62) - 1)
#define FAR (1LL << 52) /* times beyond it are left to Python, whose numbers do not overflow */
#define INTERFRAME_BITS 3
#define NUMBER_BITS 24
#define STANDARD_BITS 47
#define EXTENDED_BITS 67

typedef long long us;

typedef struct {
    PyObject_HEAD
    PyObject *timetable, *device, *port;
    us at_us, tick_us;
} Station;

typedef struct {
    PyObject_HEAD
    PyObject *stations, *ticks;
    us first_us, in_step, open_us;
} Timetable;

typedef struct {
    PyObject_HEAD
    PyObject *accepts, *behind, *device, *error_aware, *first, *more, *reconfigured_by;
    PyObject *auto_recovery, *controller, *next, *on_error_state, *segment, *unfiltered, *wake, *wire;
    us arrived_us, held, lost, number, room, waiting;
} End;

typedef struct {
    PyObject_HEAD
    PyObject *ends, *heads, *slow;
    us free;
} Arbiter;

typedef struct {
    PyObject_HEAD
    PyObject *table, *ends, *unfiltered;
} Routes;

typedef struct {
    PyObject_HEAD
    PyObject *spans;
    us since, until;
} Busy;

typedef struct {
    PyObject_HEAD
    PyObject *arbiter, *confinement, *faults, *finish, *news, *observers, *on_traffic;
    PyObject *recovery, *repeating, *sound, *stale, *announced, *winners;
    PyObject *busy, *received, *routes, *shorted, *whole;
    us due_us, free, on_bus, start, bit, now_us, unit;
} Segment;

static PyTypeObject *StationType, *TimetableType, *EndType, *ArbiterType, *RoutesType, *BusyType,
    *SegmentType;

/* The class in Python that was met last, of each type: most questions end there (3 % of a bus). */
static PyTypeObject *usual_Station, *usual_Timetable, *usual_End, *usual_Arbiter, *usual_Routes,
    *usual_Busy, *usual_Segment;

static int
is_of(PyObject *item, PyTypeObject *type, PyTypeObject **usual)
{
    if (item == NULL || !PyObject_TypeCheck(item, type))
        return 0;
    PyTypeObject *before = *usual;
    *usual = (PyTypeObject *)Py_NewRef(Py_TYPE(item));
    Py_XDECREF(before);
    return 1;
}

#define IS(item, name)                                                                           \
    (((item) != NULL && Py_TYPE(item) == usual_##name) ||                                         \
     is_of((PyObject *)(item), name##Type, &usual_##name))
#define OBJECT(name, type, field) {name, T_OBJECT_EX, offsetof(type, field), 0, NULL}
#define NUMBER(name, type, field) {name, T_LONGLONG, offsetof(type, field), 0, NULL}

static PyMemberDef station_fields[] = {
    OBJECT("_timetable", Station, timetable), OBJECT("device", Station, device),
    OBJECT("port", Station, port), NUMBER("at_us", Station, at_us),
    NUMBER("tick_us", Station, tick_us), {NULL}};
static PyMemberDef timetable_fields[] = {
    OBJECT("_stations", Timetable, stations), OBJECT("_ticks", Timetable, ticks),
    NUMBER("first_us", Timetable, first_us), NUMBER("in_step", Timetable, in_step),
    NUMBER("open_us", Timetable, open_us), {NULL}};
static PyMemberDef end_fields[] = {
    OBJECT("_accepts", End, accepts), OBJECT("_behind", End, behind),
    OBJECT("_device", End, device), OBJECT("_error_aware", End, error_aware),
    OBJECT("_first", End, first), OBJECT("_more", End, more),
    OBJECT("_reconfigured_by", End, reconfigured_by),
    OBJECT("auto_recovery", End, auto_recovery), OBJECT("controller", End, controller),
    OBJECT("next", End, next), OBJECT("on_error_state", End, on_error_state),
    OBJECT("segment", End, segment), OBJECT("unfiltered", End, unfiltered),
    OBJECT("wake", End, wake), OBJECT("wire", End, wire), NUMBER("arrived_us", End, arrived_us),
    NUMBER("held", End, held), NUMBER("lost", End, lost), NUMBER("number", End, number),
    NUMBER("room", End, room), NUMBER("waiting", End, waiting), {NULL}};
static PyMemberDef arbiter_fields[] = {
    OBJECT("_ends", Arbiter, ends), OBJECT("heads", Arbiter, heads),
    OBJECT("slow", Arbiter, slow), NUMBER("free", Arbiter, free), {NULL}};
static PyMemberDef routes_fields[] = {
    OBJECT("_table", Routes, table), OBJECT("ends", Routes, ends),
    OBJECT("unfiltered", Routes, unfiltered), {NULL}};
static PyMemberDef busy_fields[] = {
    OBJECT("_spans", Busy, spans), NUMBER("_since", Busy, since), NUMBER("_until", Busy, until),
    {NULL}};
static PyMemberDef segment_fields[] = {
    OBJECT("_arbiter", Segment, arbiter), OBJECT("_confinement", Segment, confinement),
    OBJECT("_faults", Segment, faults), OBJECT("_finish", Segment, finish),
    OBJECT("_news", Segment, news),
    OBJECT("_observers", Segment, observers), OBJECT("_on_traffic", Segment, on_traffic),
    OBJECT("_recovery", Segment, recovery), OBJECT("_repeating", Segment, repeating),
    OBJECT("_sound", Segment, sound), OBJECT("_stale", Segment, stale),
    OBJECT("_announced", Segment, announced), OBJECT("_winners", Segment, winners),
    OBJECT("busy", Segment, busy), OBJECT("received", Segment, received),
    OBJECT("routes", Segment, routes), OBJECT("shorted", Segment, shorted),
    OBJECT("whole", Segment, whole), NUMBER("_due_us", Segment, due_us),
    NUMBER("_free", Segment, free), NUMBER("_on_bus", Segment, on_bus),
    NUMBER("_start", Segment, start), NUMBER("bit", Segment, bit),
    NUMBER("now_us", Segment, now_us), NUMBER("unit", Segment, unit), {NULL}};

/* The Python methods, and whether they are to do everything. */

enum { STATION_WAKE, TIMETABLE_ENTER, TIMETABLE_TAKE, END_POLL, END_SEND, END_RECEIVE,
       ARBITER_PUSH, SEGMENT_PLAN, SEGMENT_DELIVER, SEGMENT_ADVANCE,
       SEGMENT_ADVANCE_UNTIL, SEGMENT_SEND, IGNORE, METHODS };
static PyObject *reference[METHODS];
static int enabled = 1;
static PyObject *empty_tuple, *deque;

#define NAMES(name) static PyObject *s_##name;
#define EACH_NAME(name) name(advance) name(send) name(poll) name(tick) name(due_us) name(popleft) \
    name(append) name(extend) name(_is_sound) name(_notify_changes) name(receivers) name(now_us) \
    name(passed_us) name(until_us)
EACH_NAME(NAMES)

static void
put(PyObject **field, PyObject *value) /* takes a new reference to value */
{
    PyObject *old = *field;
    *field = Py_NewRef(value);
    Py_XDECREF(old);
}

static PyObject *
by_reference(int method, PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    PyObject *all[6] = {self};
    if (reference[method] == NULL) {
        PyErr_SetString(PyExc_RuntimeError, "the kernel has no Python method for this");
        return NULL;
    }
    for (Py_ssize_t i = 0; i < count; i++)
        all[i + 1] = args[i];
    return PyObject_Vectorcall(reference[method], all, count + 1, NULL);
}

static int
done(PyObject *result) /* drops what a call returned; -1 if it raised */
{
    if (result == NULL)
        return -1;
    Py_DECREF(result);
    return 0;
}

static inline us
read_whole(PyObject *item, int *over) /* as `PyLong_AsLongLongAndOverflow` */
{
#if PY_VERSION_HEX < 0x030C0000 && PYLONG_BITS_IN_DIGIT == 30
    if (PyLong_CheckExact(item) && (size_t)Py_SIZE(item) <= 2) { /* digits: 3 % of a full bus */
        const digit *digits = ((PyLongObject *)item)->ob_digit;
        us low = Py_SIZE(item) ? digits[0] : 0;
        *over = 0;
        return Py_SIZE(item) > 1 ? (us)digits[1] << 30 | low : low;
    }
#endif
    return PyLong_AsLongLongAndOverflow(item, over);
}

static int
read_time(PyObject *item, us *value)
{
    if (PyFloat_Check(item)) { /* a device of users may be due at infinity */
        double time = ceil(PyFloat_AS_DOUBLE(item));
        if (!(time > -(double)FAR)) {
            PyErr_SetString(PyExc_ValueError, "a time is not a number, or before all others");
            return -1;
        }
        *value = time < (double)FAR ? (us)time : NEVER;
        return 0;
    }
    int over; /* `PyLong_AsLongLong` takes four times as long for NEVER: 4 % of an SDO */
    *value = read_whole(item, &over);
    if (over)
        PyErr_SetString(PyExc_OverflowError, "a time is beyond all others");
    return *value == -1 && PyErr_Occurred() ? -1 : 0;
}

static PyObject *
get_attribute(PyObject *item, PyObject *name) /* of a compiled class by its getter: 1 % of a bus */
{
    PyTypeObject *type = Py_TYPE(item);
    if (type->tp_getattro == PyObject_GenericGetAttr) {
        PyObject *found = _PyType_Lookup(type, name);
        if (found != NULL && Py_TYPE(found) == &PyGetSetDescr_Type) {
            PyGetSetDef *getset = ((PyGetSetDescrObject *)found)->d_getset;
            if (getset->get != NULL)
                return getset->get(item, getset->closure);
        }
    }
    return PyObject_GetAttr(item, name);
}

static int
read_attribute(PyObject *item, PyObject *name, us *value)
{
    PyObject *got = get_attribute(item, name);
    if (got == NULL)
        return -1;
    int result = read_time(got, value);
    Py_DECREF(got);
    return result;
}

static int
write_attribute(PyObject *item, PyObject *name, us value)
{
    PyObject *number = PyLong_FromLongLong(value);
    int result = number == NULL ? -1 : PyObject_SetAttr(item, name, number);
    Py_XDECREF(number);
    return result;
}

static int
wrong_number(const char *name, Py_ssize_t count, Py_ssize_t wanted)
{
    if (count == wanted)
        return 0;
    PyErr_Format(PyExc_TypeError, "%s() takes %zd arguments, not %zd", name, wanted, count);
    return 1;
}

/* Heaps of whole numbers: lists, as `heapq` keeps them. */

static int
less(PyObject *a, PyObject *b)
{
    int over_a, over_b;
    if (!PyLong_CheckExact(a) || !PyLong_CheckExact(b)) {
        PyErr_SetString(PyExc_TypeError, "a heap of the kernel holds whole numbers");
        return -1;
    }
    us x = read_whole(a, &over_a), y = read_whole(b, &over_b);
    return over_a || over_b ? PyObject_RichCompareBool(a, b, Py_LT) : x < y;
}

static int
rise(PyObject *heap, Py_ssize_t place, Py_ssize_t top)
{
    PyObject **items = ((PyListObject *)heap)->ob_item, *item = items[place];
    while (place > top) {
        Py_ssize_t parent = (place - 1) >> 1;
        int smaller = less(item, items[parent]);
        if (smaller < 0)
            return -1; /* each item is still there once */
        if (!smaller)
            break;
        items[place] = items[parent];
        items[parent] = item;
        place = parent;
    }
    return 0;
}

static int
heap_push(PyObject *heap, PyObject *item)
{
    if (PyList_Append(heap, item) < 0)
        return -1;
    return rise(heap, PyList_GET_SIZE(heap) - 1, 0);
}

static PyObject *
heap_pop(PyObject *heap) /* of a heap that is not empty */
{
    Py_ssize_t last = PyList_GET_SIZE(heap) - 1, place = 0, child;
    PyObject *item = PyList_GET_ITEM(heap, last); /* its reference; a slice takes twice the time */
    Py_SET_SIZE(heap, last);
    if (last == 0)
        return item;
    PyObject **items = ((PyListObject *)heap)->ob_item, *first = items[0];
    items[0] = item;
    while ((child = 2 * place + 1) < last) { /* down to a leaf, then up again: fewer comparisons */
        if (child + 1 < last) {
            int smaller = less(items[child + 1], items[child]);
            if (smaller < 0) {
                Py_DECREF(first);
                return NULL;
            }
            child += smaller;
        }
        items[place] = items[child];
        items[child] = item;
        place = child;
    }
    if (rise(heap, place, 0) < 0) {
        Py_DECREF(first);
        return NULL;
    }
    return first;
}

/* Frames: their length on the bus. */

typedef struct {
    uint32_t can_id;
    int extended, remote, length, code; /* bytes of data; data length code */
    const uint8_t *data;                /* of the frame's own bytes, which it keeps alive */
} Frame;

static uint8_t next_state[10][256], stuffed_bits[10][256];
static uint16_t crc_table[256];

static int
flag(PyObject *item, int *value)
{
    *value = item == Py_True;
    return *value || item == Py_False;
}

static int
read_frame(PyObject *item, Frame *frame) /* 1 if it is one; 0 without an exception if not */
{
    int over, code;
    if (item == NULL || !PyTuple_Check(item) || PyTuple_GET_SIZE(item) != 5)
        return 0;
    PyObject *can_id = PyTuple_GET_ITEM(item, 0), *data = PyTuple_GET_ITEM(item, 1);
    PyObject *length = PyTuple_GET_ITEM(item, 4);
    if (!PyLong_CheckExact(can_id) || !PyBytes_CheckExact(data) || !PyLong_CheckExact(length) ||
        !flag(PyTuple_GET_ITEM(item, 2), &frame->remote) ||
        !flag(PyTuple_GET_ITEM(item, 3), &frame->extended))
        return 0;
    us id = read_whole(can_id, &over);
    if (over || id < 0 || id > (frame->extended ? 0x1FFFFFFF : 0x7FF) || PyBytes_GET_SIZE(data) > 8)
        return 0;
    us remote_length = read_whole(length, &over);
    if (over || remote_length < 0 || remote_length > (frame->remote ? 8 : 0))
        return 0;
    frame->length = (int)PyBytes_GET_SIZE(data);
    if (frame->remote && frame->length)
        return 0;
    code = frame->remote ? (int)remote_length : frame->length;
    frame->can_id = (uint32_t)id, frame->code = code;
    frame->data = (const uint8_t *)PyBytes_AS_STRING(data);
    return 1;
}

static int
frame_bits(const Frame *frame)
{
    uint8_t stream[5 + 8 + 2];
    int size = 0, state = frame->extended ? 9 : 8, stuffed = 0;
    uint16_t crc = 0;
    if (frame->extended) {
        uint64_t head = (uint64_t)(frame->can_id >> 18) << 20 | 3 << 18 | (frame->can_id & 0x3FFFF);
        head = head << 7 | frame->remote << 6 | frame->code;
        for (int shift = 32; shift >= 0; shift -= 8)
            stream[size++] = (uint8_t)(head >> shift);
    } else {
        uint32_t head = frame->can_id << 7 | (uint32_t)frame->remote << 6 | (uint32_t)frame->code;
        for (int shift = 16; shift >= 0; shift -= 8)
            stream[size++] = (uint8_t)(head >> shift);
    }
    for (int i = 0; i < frame->length; i++)
        stream[size++] = frame->data[i];
    for (int i = 0; i < size; i++)
        crc = (uint16_t)(crc << 8) ^ crc_table[(crc >> 8) ^ stream[i]];
    stream[size++] = (uint8_t)(crc >> 8);
    stream[size++] = (uint8_t)((crc & 0xFE) | (~crc >> 1 & 1)); /* the filling bit is never stuffed */
    for (int i = 0; i < size; i++) {
        stuffed += stuffed_bits[state][stream[i]];
        state = next_state[state][stream[i]];
    }
    return (frame->extended ? EXTENDED_BITS : STANDARD_BITS) + 8 * frame->length + stuffed;
}

static uint64_t
priority(const Frame *frame)
{
    uint64_t id = frame->can_id;
    if (frame->extended)
        return (id >> 18) << 21 | 3 << 19 | (id & 0x3FFFF) << 1 | (uint64_t)frame->remote;
    return id << 21 | (uint64_t)frame->remote << 20;
}

static void
fill_tables(void)
{
    for (int state = 0; state < 10; state++)
        for (int byte = 0; byte < 256; byte++) {
            int fill = state == 8 ? 5 : state == 9 ? 1 : 0, stuffed = 0;
            int last = fill ? -1 : state >> 2, run = fill ? 0 : (state & 3) + 1;
            for (int place = 7 - fill; place >= 0; place--) {
                int bit = byte >> place & 1;
                run = bit == last ? run + 1 : 1;
                last = bit;
                if (run == 5)
                    last = 1 - bit, run = 1, stuffed++;
            }
            next_state[state][byte] = (uint8_t)(last << 2 | (run - 1));
            stuffed_bits[state][byte] = (uint8_t)stuffed;
        }
    for (int byte = 0; byte < 256; byte++) {
        uint16_t crc = (uint16_t)(byte << 8);
        for (int i = 0; i < 8; i++)
            crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ 0x4599 << 1 : crc << 1);
        crc_table[byte] = crc;
    }
}

/* Timetable and stations. */

/* The list that was found last: a SYNC wakes all stations for one tick, and their heartbeats are
   due in one (4 % of a full bus). It is borrowed from a dict that has not changed since: no two
   dicts, and no two states of one, have the same version. */
#if PY_VERSION_HEX < 0x030C0000
static uint64_t found_version;
static us found_us;
static PyObject *found_list;
#define VERSION(dict) (((PyDictObject *)(dict))->ma_version_tag)
#define FOUND(dict, at_us) (found_version == VERSION(dict) && found_us == (at_us) ? found_list : NULL)
#define FIND(dict, us, list) (found_version = VERSION(dict), found_us = (us), found_list = (list))
#else
#define FOUND(dict, at_us) NULL
#define FIND(dict, us, list)
#endif

static int
enter(Timetable *table, Station *station, us at_us)
{
    if (at_us >= station->at_us)
        return 0;
    if (station->tick_us <= 0 || at_us > FAR || table->open_us > FAR || table->open_us < 0 ||
        !table->ticks || !PyList_CheckExact(table->ticks) || !table->stations ||
        !PyDict_CheckExact(table->stations)) {
        PyObject *number = PyLong_FromLongLong(at_us), *args[] = {(PyObject *)station, number};
        int result = number == NULL
            ? -1 : done(by_reference(TIMETABLE_ENTER, (PyObject *)table, args, 2));
        Py_XDECREF(number);
        return result;
    }
    if (at_us < table->open_us)
        at_us = table->open_us;
    at_us = (at_us + station->tick_us - 1) / station->tick_us * station->tick_us;
    if (at_us >= station->at_us)
        return 0;
    PyObject *there = FOUND(table->stations, at_us);
    if (there != NULL) {
        if (PyList_Append(there, (PyObject *)station) < 0)
            return -1;
        station->at_us = at_us;
        return 0;
    }
    PyObject *key = PyLong_FromLongLong(at_us);
    if (key == NULL)
        return -1;
    int result = -1;
    there = PyDict_GetItemWithError(table->stations, key);
    if (there != NULL && PyList_CheckExact(there)) {
        result = PyList_Append(there, (PyObject *)station);
        FIND(table->stations, at_us, there);
    } else if (!PyErr_Occurred()) {
        PyObject *made = PyList_New(1);
        if (made != NULL) {
            PyList_SET_ITEM(made, 0, Py_NewRef(station));
            result = PyDict_SetItem(table->stations, key, made);
            if (result == 0)
                FIND(table->stations, at_us, made);
            Py_DECREF(made);
        }
        if (result == 0)
            result = heap_push(table->ticks, key);
        if (result == 0 && at_us < table->first_us)
            table->first_us = at_us;
    }
    if (result == 0)
        station->at_us = at_us;
    Py_DECREF(key);
    return result;
}

static PyObject *
timetable_enter(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    us at_us;
    if (wrong_number("enter", count, 2))
        return NULL;
    if (!enabled || !IS(args[0], Station))
        return by_reference(TIMETABLE_ENTER, self, args, count);
    if (read_time(args[1], &at_us) < 0 || enter((Timetable *)self, (Station *)args[0], at_us) < 0)
        return NULL;
    Py_RETURN_NONE;
}

static PyObject *
take(Timetable *table, us now_us) /* the stations with work; NULL: an exception */
{
    PyObject *taken = PyList_New(0);
    if (taken == NULL)
        return NULL;
    while (PyList_GET_SIZE(table->ticks)) {
        us at_us;
        PyObject *key = PyList_GET_ITEM(table->ticks, 0);
        if (read_time(key, &at_us) < 0)
            goto failed;
        PyObject *there = PyDict_GetItemWithError(table->stations, key);
        if (there == NULL || !PyList_CheckExact(there)) {
            if (!PyErr_Occurred())
                PyErr_SetObject(PyExc_KeyError, key);
            goto failed;
        }
        int standing = 0;
        for (Py_ssize_t i = 0; i < PyList_GET_SIZE(there); i++) {
            Station *station = (Station *)PyList_GET_ITEM(there, i);
            if (!IS((PyObject *)station, Station) || station->at_us != at_us)
                continue;
            standing = 1;
            if (at_us > now_us)
                break;
            station->at_us = NEVER;
            if (PyList_Append(taken, (PyObject *)station) < 0)
                goto failed;
        }
        if (at_us > now_us && standing) {
            table->first_us = at_us;
            return taken;
        }
        key = heap_pop(table->ticks); /* a tick that is over, or whose stations went elsewhere */
        if (key == NULL || PyDict_DelItem(table->stations, key) < 0) {
            Py_XDECREF(key);
            goto failed;
        }
        Py_DECREF(key);
    }
    table->first_us = NEVER;
    return taken;
failed:
    Py_DECREF(taken);
    return NULL;
}

static int
is_table(PyObject *item)
{
    Timetable *table = (Timetable *)item;
    return IS(item, Timetable) && table->ticks && PyList_CheckExact(table->ticks) &&
           table->stations && PyDict_CheckExact(table->stations);
}

static PyObject *
timetable_take(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    us now_us;
    if (wrong_number("take", count, 1))
        return NULL;
    if (!enabled || !is_table(self))
        return by_reference(TIMETABLE_TAKE, self, args, count);
    if (read_time(args[0], &now_us) < 0)
        return NULL;
    if (((Timetable *)self)->first_us > now_us)
        return PyList_New(0);
    return take((Timetable *)self, now_us);
}

static PyObject *
station_wake(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    Station *station = (Station *)self;
    us at_us;
    if (wrong_number("_wake", count, 1))
        return NULL;
    if (!enabled || !IS(station->timetable, Timetable))
        return by_reference(STATION_WAKE, self, args, count);
    if (read_time(args[0], &at_us) < 0 || enter((Timetable *)station->timetable, station, at_us) < 0)
        return NULL;
    Py_RETURN_NONE;
}

static int
wake(PyObject *callback, us at_us)
{
    if (callback != NULL && PyCFunction_CheckExact(callback) &&
        PyCFunction_GET_FUNCTION(callback) == (PyCFunction)(void (*)(void))station_wake) {
        Station *station = (Station *)PyCFunction_GET_SELF(callback);
        if (IS(station->timetable, Timetable))
            return enter((Timetable *)station->timetable, station, at_us);
    }
    if (callback != NULL && callback == reference[IGNORE])
        return 0;
    PyObject *number = PyLong_FromLongLong(at_us);
    if (number == NULL || callback == NULL) {
        Py_XDECREF(number);
        return callback == NULL ? (PyErr_SetString(PyExc_AttributeError, "wake"), -1) : -1;
    }
    Py_INCREF(callback);
    int result = done(PyObject_CallOneArg(callback, number));
    Py_DECREF(callback);
    Py_DECREF(number);
    return result;
}

/* Arbitration. */

static int
push(Arbiter *arbiter, End *end)
{
    Frame frame;
    if (!arbiter->heads || !PyList_CheckExact(arbiter->heads) || !read_frame(end->next, &frame) ||
        end->number < -1 || end->number >= (1 << NUMBER_BITS) - 1) {
        PyObject *args[] = {(PyObject *)end};
        return done(by_reference(ARBITER_PUSH, (PyObject *)arbiter, args, 1));
    }
    uint64_t head = priority(&frame) << NUMBER_BITS | (uint64_t)(end->number + 1);
    PyObject *number = PyLong_FromUnsignedLongLong(head);
    int result = number == NULL ? -1 : heap_push(arbiter->heads, number);
    Py_XDECREF(number);
    return result;
}

static PyObject *
arbiter_push(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    if (wrong_number("push", count, 1))
        return NULL;
    if (!enabled || !IS(args[0], End))
        return by_reference(ARBITER_PUSH, self, args, count);
    if (push((Arbiter *)self, (End *)args[0]) < 0)
        return NULL;
    Py_RETURN_NONE;
}

/* The bus. */

static int
is_whole(Segment *segment) /* its parts are what this file can work on */
{
    Arbiter *arbiter = (Arbiter *)segment->arbiter;
    return IS(segment->arbiter, Arbiter) && IS(segment->routes, Routes) &&
           IS(segment->busy, Busy) && segment->winners && PyList_CheckExact(segment->winners) &&
           arbiter->heads && PyList_CheckExact(arbiter->heads) && arbiter->ends &&
           PyDict_Check(arbiter->ends) && segment->bit > 0 && segment->unit > 0 &&
           segment->observers && PyList_Check(segment->observers);
}

static int
is_sound(Segment *segment) /* -1: an exception */
{
    if (segment->sound == Py_True)
        return is_whole(segment);
    PyObject *sound = PyObject_CallMethodNoArgs((PyObject *)segment, s__is_sound);
    if (sound == NULL)
        return -1;
    put(&segment->sound, sound);
    Py_DECREF(sound);
    return segment->sound == Py_True && is_whole(segment);
}

static int
same_rank(PyObject *heads, Py_ssize_t place, us head)
{
    int over;
    if (place >= PyList_GET_SIZE(heads))
        return 0;
    us other = read_whole(PyList_GET_ITEM(heads, place), &over);
    return over || other >> NUMBER_BITS == head >> NUMBER_BITS;
}

static int
set_winner(Segment *segment, PyObject *end) /* one, or none if `end` is NULL */
{
    PyObject *winners = segment->winners;
    Py_ssize_t count = end == NULL ? 0 : 1;
    if (winners == NULL || !PyList_CheckExact(winners) || Py_REFCNT(winners) > 1) {
        PyObject *made = PyList_New(count);
        if (made == NULL)
            return -1;
        if (count)
            PyList_SET_ITEM(made, 0, Py_NewRef(end));
        put(&segment->winners, made);
        Py_DECREF(made);
        return 0;
    }
    Py_ssize_t before = PyList_GET_SIZE(winners);
    if (count && before == 1)
        return PyList_SetItem(winners, 0, Py_NewRef(end));
    if (before == 1) {
        PyObject *last = PyList_GET_ITEM(winners, 0);
        Py_SET_SIZE(winners, 0);
        Py_DECREF(last);
    } else if (before && PyList_SetSlice(winners, 0, before, NULL) < 0)
        return -1;
    return count ? PyList_Append(winners, end) : 0; /* the list keeps its room */
}

static int
plan(Segment *segment) /* CanSegment._plan */
{
    int sound = is_sound(segment), over;
    Frame frame;
    if (sound < 0)
        return -1;
    if (!sound)
        return done(by_reference(SEGMENT_PLAN, (PyObject *)segment, NULL, 0));
    Arbiter *arbiter = (Arbiter *)segment->arbiter;
    PyObject *heads = arbiter->heads;
    if (!PyList_GET_SIZE(heads)) {
        put(&segment->stale, Py_False);
        segment->start = segment->due_us = NEVER;
        return 0;
    }
    PyObject *item = PyList_GET_ITEM(heads, 0);
    us head = PyLong_CheckExact(item) ? read_whole(item, &over) : (over = 1);
    if (over || same_rank(heads, 1, head) || same_rank(heads, 2, head) || arbiter->free > FAR)
        return done(by_reference(SEGMENT_PLAN, (PyObject *)segment, NULL, 0));
    PyObject *number = PyLong_FromLongLong(head & ((1 << NUMBER_BITS) - 1));
    if (number == NULL)
        return -1;
    PyObject *end = PyDict_GetItemWithError(arbiter->ends, number);
    Py_DECREF(number);
    if (end == NULL && PyErr_Occurred())
        return -1;
    if (!IS(end, End) || !read_frame(((End *)end)->next, &frame))
        return done(by_reference(SEGMENT_PLAN, (PyObject *)segment, NULL, 0));
    Py_INCREF(end);
    PyObject *taken = heap_pop(heads);
    int result = taken == NULL ? -1 : set_winner(segment, end);
    Py_DECREF(end);
    Py_XDECREF(taken);
    if (result < 0)
        return -1;
    put(&segment->stale, Py_False);
    put(&segment->finish, Py_None);
    segment->start = arbiter->free;
    segment->free = arbiter->free + frame_bits(&frame) * segment->bit;
    us ended = segment->free - INTERFRAME_BITS * segment->bit;
    segment->due_us = (ended + segment->unit - 1) / segment->unit;
    return 0;
}

static PyObject *
segment_plan(PyObject *self, PyObject *none)
{
    if (!enabled)
        return by_reference(SEGMENT_PLAN, self, NULL, 0);
    if (plan((Segment *)self) < 0)
        return NULL;
    Py_RETURN_NONE;
}

static int
note(Busy *busy, us since, us until) /* BusyTime.note */
{
    if (since != busy->until) {
        PyObject *first = PyLong_FromLongLong(busy->since);
        PyObject *last = PyLong_FromLongLong(busy->until);
        PyObject *span = first && last && busy->spans ? PyTuple_Pack(2, first, last) : NULL;
        if (span != NULL)
            PyObject_GC_UnTrack(span); /* of numbers alone; thousands of them stay */
        int result = span == NULL
            ? -1 : done(PyObject_CallMethodOneArg(busy->spans, s_append, span));
        Py_XDECREF(first);
        Py_XDECREF(last);
        Py_XDECREF(span);
        if (result < 0)
            return -1;
        busy->since = since;
    }
    busy->until = until;
    return 0;
}

static PyObject *
take_next(End *end) /* CanEnd.take: a new reference */
{
    PyObject *frame = Py_NewRef(end->next);
    end->waiting--;
    if (end->behind != NULL && end->behind != Py_None && PyObject_Size(end->behind) > 0) {
        PyObject *next = PyObject_CallMethodNoArgs(end->behind, s_popleft);
        if (next == NULL) {
            Py_DECREF(frame);
            return NULL;
        }
        put(&end->next, next);
        Py_DECREF(next);
    }
    return frame;
}

static int
receive(PyObject *item, us at_us, PyObject *frame, PyObject *alone)
{
    End *end = (End *)item;
    int usual = IS(item, End) && end->first && PyTuple_CheckExact(end->first) &&
                !PyTuple_GET_SIZE(end->first) && IS(end->segment, Segment) &&
                end->reconfigured_by && PyAnySet_Check(end->reconfigured_by);
    if (!usual) {
        PyObject *number = PyLong_FromLongLong(at_us), *args[] = {number, frame, alone};
        int result = number == NULL ? -1 : done(by_reference(END_RECEIVE, item, args, 3));
        Py_XDECREF(number);
        return result;
    }
    put(&end->first, alone);
    end->arrived_us = at_us;
    if (wake(end->wake, at_us) < 0)
        return -1;
    Segment *segment = (Segment *)end->segment;
    if (!IS(end->segment, Segment))
        return 0;
    put(&segment->received, Py_True);
    if (end->unfiltered != Py_False || !PySet_GET_SIZE(end->reconfigured_by))
        return 0;
    int reconfigured = PySet_Contains(end->reconfigured_by, PyTuple_GET_ITEM(frame, 0));
    if (reconfigured <= 0)
        return reconfigured;
    Routes *routes = (Routes *)segment->routes;
    put(&end->unfiltered, Py_True);
    if (IS(segment->routes, Routes) && routes->unfiltered && PyList_Check(routes->unfiltered))
        return PyList_Append(routes->unfiltered, item);
    PyErr_SetString(PyExc_TypeError, "a bus without routes");
    return -1;
}

static PyObject *
receivers(Routes *routes, PyObject *frame, int extended) /* a new reference to a tuple */
{
    if (!extended && routes->unfiltered && PyList_Check(routes->unfiltered) &&
        !PyList_GET_SIZE(routes->unfiltered) && routes->table && PyDict_Check(routes->table)) {
        PyObject *found = PyDict_GetItemWithError(routes->table, PyTuple_GET_ITEM(frame, 0));
        if (found != NULL)
            return Py_NewRef(found);
        if (PyErr_Occurred())
            return NULL;
    }
    return PyObject_CallMethodOneArg((PyObject *)routes, s_receivers, frame);
}

static int
deliver(Segment *segment) /* CanSegment._deliver of one winner on a sound bus */
{
    End *sender = (End *)PyList_GET_ITEM(segment->winners, 0);
    Frame read;
    if (!read_frame(sender->next, &read))
        return done(by_reference(SEGMENT_DELIVER, (PyObject *)segment, NULL, 0));
    us at_us = segment->due_us;
    int result = -1;
    PyObject *number = NULL, *frame = NULL, *found = NULL, *alone = NULL;
    Arbiter *arbiter = (Arbiter *)Py_NewRef(segment->arbiter);
    PyObject *observers = Py_NewRef(segment->observers);
    Py_INCREF(sender);
    if ((frame = take_next(sender)) == NULL)
        goto end;
    if (PyList_GET_SIZE(observers) && (number = PyLong_FromLongLong(at_us)) == NULL)
        goto end;
    for (Py_ssize_t i = 0; i < PyList_GET_SIZE(observers); i++) {
        PyObject *args[] = {number, frame}, *observe = Py_NewRef(PyList_GET_ITEM(observers, i));
        int told = done(PyObject_Vectorcall(observe, args, 2, NULL));
        Py_DECREF(observe);
        if (told < 0)
            goto end;
    }
    arbiter->free = segment->free;
    if (PyList_GET_SIZE(observers) && !is_whole(segment)) {
        PyErr_SetString(PyExc_TypeError, "a bus has lost its parts");
        goto end;
    }
    if (note((Busy *)segment->busy, segment->start, segment->free) < 0)
        goto end;
    if (sender->waiting && push(arbiter, sender) < 0)
        goto end;
    if (set_winner(segment, NULL) < 0)
        goto end;
    found = receivers((Routes *)segment->routes, frame, read.extended);
    if (found == NULL || !PyTuple_Check(found))
        goto end;
    if (PyTuple_GET_SIZE(found)) {
        if ((alone = PyTuple_Pack(1, frame)) == NULL)
            goto end;
        for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(found); i++) {
            PyObject *end = PyTuple_GET_ITEM(found, i);
            if (end != (PyObject *)sender && receive(end, at_us, frame, alone) < 0)
                goto end;
        }
    }
    result = 0;
end:
    if (result < 0 && !PyErr_Occurred())
        PyErr_SetString(PyExc_TypeError, "receivers of a frame are no tuple");
    Py_DECREF(sender);
    Py_DECREF(arbiter);
    Py_DECREF(observers);
    Py_XDECREF(number);
    Py_XDECREF(frame);
    Py_XDECREF(found);
    Py_XDECREF(alone);
    return result;
}

static int
finish(Segment *segment) /* end what was planned */
{
    if (segment->finish == Py_None && segment->sound == Py_True && is_whole(segment) &&
        PyList_GET_SIZE(segment->winners) == 1 &&
        IS(PyList_GET_ITEM(segment->winners, 0), End))
        return deliver(segment);
    put(&segment->sound, Py_False); /* what follows may count errors */
    if (segment->finish == NULL || segment->finish == Py_None)
        return done(by_reference(SEGMENT_DELIVER, (PyObject *)segment, NULL, 0));
    PyObject *end = Py_NewRef(segment->finish);
    int result = done(PyObject_CallNoArgs(end));
    Py_DECREF(end);
    return result;
}

static int
advance_until(Segment *segment, us until_us) /* 1 if somebody was woken; -1: an exception */
{
    put(&segment->received, Py_False);
    if (segment->stale != Py_False && plan(segment) < 0)
        return -1;
    while (segment->due_us <= until_us) {
        if (finish(segment) < 0)
            return -1;
        put(&segment->stale, Py_True);
        if (segment->news == NULL || !PyList_CheckExact(segment->news) ||
            PyList_GET_SIZE(segment->news)) {
            if (done(PyObject_CallMethodNoArgs((PyObject *)segment, s__notify_changes)) < 0)
                return -1;
        }
        if (segment->stale != Py_False && plan(segment) < 0)
            return -1;
        if (segment->received == Py_True)
            return 1;
    }
    return 0;
}

static int
advance(Segment *segment, us now_us)
{
    int woken;
    do
        woken = advance_until(segment, now_us);
    while (woken > 0);
    if (segment->now_us < now_us)
        segment->now_us = now_us;
    return woken;
}

static PyObject *
segment_advance_until_received(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    us until_us;
    if (wrong_number("advance_until_received", count, 1))
        return NULL;
    if (!enabled)
        return by_reference(SEGMENT_ADVANCE_UNTIL, self, args, count);
    if (read_time(args[0], &until_us) < 0)
        return NULL;
    int woken = advance_until((Segment *)self, until_us);
    return woken < 0 ? NULL : PyBool_FromLong(woken);
}

static PyObject *
segment_advance(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    us now_us;
    if (wrong_number("advance", count, 1))
        return NULL;
    if (!enabled)
        return by_reference(SEGMENT_ADVANCE, self, args, count);
    if (read_time(args[0], &now_us) < 0 || advance((Segment *)self, now_us) < 0)
        return NULL;
    Py_RETURN_NONE;
}

static int
plan_anew(Segment *segment) /* CanSegment._plan_anew */
{
    put(&segment->stale, Py_True);
    if (segment->announced == Py_True)
        return 0;
    put(&segment->announced, Py_True);
    PyObject *listeners = Py_XNewRef(segment->on_traffic);
    int result = listeners != NULL && PyList_Check(listeners) ? 0 : -1;
    for (Py_ssize_t i = 0; result == 0 && i < PyList_GET_SIZE(listeners); i++) {
        PyObject *tell = Py_NewRef(PyList_GET_ITEM(listeners, i));
        result = done(PyObject_CallNoArgs(tell));
        Py_DECREF(tell);
    }
    Py_XDECREF(listeners);
    return result;
}

static int
enqueue(End *end, PyObject *frames) /* CanEnd.enqueue, of a tuple that is not empty */
{
    Py_ssize_t count = PyTuple_GET_SIZE(frames), place = 0;
    if (!end->waiting) {
        PyObject *next = PyTuple_GET_ITEM(frames, place++);
        put(&end->next, next);
    }
    if (place < count) {
        PyObject *behind = PyTuple_GetSlice(frames, place, count), *queue = Py_XNewRef(end->behind);
        int result = behind == NULL ? -1 : 0;
        if (result == 0 && (queue == NULL || queue == Py_None)) {
            Py_XSETREF(queue, PyObject_CallNoArgs(deque));
            result = queue == NULL ? -1 : 0;
            if (result == 0)
                put(&end->behind, queue);
        }
        if (result == 0)
            result = done(PyObject_CallMethodOneArg(queue, s_extend, behind));
        Py_XDECREF(behind);
        Py_XDECREF(queue);
        if (result < 0)
            return -1;
    }
    end->waiting += count;
    return 0;
}

static int
send_frames(Segment *segment, End *end, us now_us, PyObject *frames) /* CanSegment.send */
{
    PyObject *number;
    if (segment->now_us < now_us && advance(segment, now_us) < 0)
        return -1;
    Py_ssize_t count = PyTuple_CheckExact(frames) ? PyTuple_GET_SIZE(frames) : 0;
    int sound = is_sound(segment);
    if (sound < 0)
        return -1;
    if (!sound || !count || end->waiting < 0 || end->waiting + count > end->room || now_us > FAR ||
        now_us < 0 || !IS(segment->arbiter, Arbiter)) {
        if ((number = PyLong_FromLongLong(now_us)) == NULL)
            return -1;
        PyObject *args[] = {(PyObject *)end, number, frames};
        int result = done(by_reference(SEGMENT_SEND, (PyObject *)segment, args, 3));
        Py_DECREF(number);
        return result;
    }
    Arbiter *arbiter = (Arbiter *)segment->arbiter;
    us now = now_us * segment->unit;
    int idle = !end->waiting;
    if (segment->start >= now && segment->stale == Py_False) { /* CanSegment._withdraw */
        for (Py_ssize_t i = 0; i < PyList_GET_SIZE(segment->winners); i++) {
            PyObject *winner = PyList_GET_ITEM(segment->winners, i);
            if (IS(winner, End) && ((End *)winner)->waiting && push(arbiter, (End *)winner) < 0)
                return -1;
        }
        if (set_winner(segment, NULL) < 0)
            return -1;
        segment->start = NEVER;
        if (plan_anew(segment) < 0)
            return -1;
    }
    if (enqueue(end, frames) < 0)
        return -1;
    if (!idle)
        return 0;
    if (!is_whole(segment) || (PyObject *)arbiter != segment->arbiter) {
        PyErr_SetString(PyExc_TypeError, "a bus has lost its parts");
        return -1;
    }
    if (!PyList_GET_SIZE(arbiter->heads) && !PyList_GET_SIZE(segment->winners) &&
        arbiter->free < now)
        arbiter->free = now;
    if (end->held < now)
        end->held = now;
    return push(arbiter, end);
}

static PyObject *
segment_send(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    us now_us;
    if (wrong_number("send", count, 3))
        return NULL;
    if (!enabled || !IS(args[0], End))
        return by_reference(SEGMENT_SEND, self, args, count);
    if (read_time(args[1], &now_us) < 0 ||
        send_frames((Segment *)self, (End *)args[0], now_us, args[2]) < 0)
        return NULL;
    Py_RETURN_NONE;
}

/* Ends. */

static PyObject *
poll(End *end, us now_us, PyObject *number) /* CanEnd.poll; number: the same time, or NULL */
{
    Segment *segment = (Segment *)end->segment;
    if (!IS(end->segment, Segment) || !IS(segment->routes, Routes) || end->first == NULL ||
        !PyTuple_CheckExact(end->first) ||
        (end->more != Py_None && PyTuple_GET_SIZE(end->first))) {
        PyObject *args[] = {number != NULL ? Py_NewRef(number) : PyLong_FromLongLong(now_us)};
        PyObject *frames = args[0] == NULL ? NULL : by_reference(END_POLL, (PyObject *)end, args, 1);
        Py_XDECREF(args[0]);
        return frames;
    }
    if (segment->now_us < now_us) {
        PyObject *time = number != NULL ? Py_NewRef(number) : PyLong_FromLongLong(now_us);
        if (time == NULL || end->wire == NULL)
            return time == NULL ? NULL : (Py_DECREF(time), PyErr_NoMemory());
        PyObject *wire = Py_NewRef(end->wire);
        int result = done(PyObject_CallMethodOneArg(wire, s_advance, time));
        Py_DECREF(wire);
        Py_DECREF(time);
        if (result < 0)
            return NULL;
        segment = (Segment *)end->segment;
        if (!IS(end->segment, Segment) || !IS(segment->routes, Routes) ||
            end->first == NULL || !PyTuple_CheckExact(end->first) ||
            (end->more != Py_None && PyTuple_GET_SIZE(end->first)))
            return poll(end, now_us, number);
    }
    if (end->unfiltered == Py_True) {
        PyObject *open = ((Routes *)segment->routes)->unfiltered;
        put(&end->unfiltered, Py_False);
        for (Py_ssize_t i = 0; open && PyList_Check(open) && i < PyList_GET_SIZE(open); i++)
            if (PyList_GET_ITEM(open, i) == (PyObject *)end) {
                if (PyList_SetSlice(open, i, i + 1, NULL) < 0)
                    return NULL;
                break;
            }
    }
    PyObject *frames = Py_NewRef(end->first);
    if (PyTuple_GET_SIZE(frames)) {
        put(&end->first, empty_tuple);
        end->arrived_us = NEVER;
    }
    return frames;
}

static PyObject *
end_poll(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    us now_us;
    if (wrong_number("poll", count, 1))
        return NULL;
    if (!enabled)
        return by_reference(END_POLL, self, args, count);
    if (read_time(args[0], &now_us) < 0)
        return NULL;
    return poll((End *)self, now_us, args[0]);
}

static PyObject *
end_send(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    End *end = (End *)self;
    us now_us;
    if (wrong_number("send", count, 2))
        return NULL;
    if (!enabled || !IS(end->segment, Segment) || !PyTuple_CheckExact(args[1]))
        return by_reference(END_SEND, self, args, count);
    if (!PyTuple_GET_SIZE(args[1]))
        Py_RETURN_NONE;
    if (read_time(args[0], &now_us) < 0)
        return NULL;
    Segment *segment = (Segment *)Py_NewRef(end->segment);
    int result = send_frames(segment, end, now_us, args[1]);
    Py_DECREF(segment);
    return result < 0 ? NULL : Py_NewRef(Py_None);
}

static PyObject *
end_receive(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    us at_us;
    Frame frame;
    if (wrong_number("receive", count, 3))
        return NULL;
    if (!enabled || !read_frame(args[1], &frame) || !PyTuple_CheckExact(args[2]))
        return by_reference(END_RECEIVE, self, args, count);
    if (read_time(args[0], &at_us) < 0 || receive(self, at_us, args[1], args[2]) < 0)
        return NULL;
    Py_RETURN_NONE;
}

/* Types. */

#define FIELDS(type, first, last, fields, methods)                                               \
    static int type##_traverse(PyObject *self, visitproc visit, void *arg)                      \
    {                                                                                            \
        PyObject **field = &((type *)self)->first, **end = &((type *)self)->last;               \
        Py_VISIT(Py_TYPE(self));                                                                 \
        for (; field <= end; field++)                                                            \
            Py_VISIT(*field);                                                                    \
        return 0;                                                                                \
    }                                                                                            \
    static int type##_clear(PyObject *self)                                                      \
    {                                                                                            \
        PyObject **field = &((type *)self)->first, **end = &((type *)self)->last;               \
        for (; field <= end; field++)                                                            \
            Py_CLEAR(*field);                                                                    \
        return 0;                                                                                \
    }                                                                                            \
    static void type##_dealloc(PyObject *self)                                                   \
    {                                                                                            \
        PyTypeObject *its = Py_TYPE(self);                                                       \
        PyObject_GC_UnTrack(self);                                                               \
        type##_clear(self);                                                                      \
        its->tp_free(self);                                                                      \
        Py_DECREF(its);                                                                          \
    }                                                                                            \
    static PyType_Slot type##_slots[] = {{Py_tp_traverse, type##_traverse},                      \
                                         {Py_tp_clear, type##_clear},                            \
                                         {Py_tp_dealloc, type##_dealloc},                        \
                                         {Py_tp_members, fields},                                \
                                         {Py_tp_methods, methods},                               \
                                         {0, NULL}};                                             \
    static PyType_Spec type##_spec = {                                                           \
        "tickrig.emulators.rig._kernel." #type "Fields", sizeof(type), 0,                        \
        Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE | Py_TPFLAGS_HAVE_GC, type##_slots};

#define FAST(name, function) {name, (PyCFunction)(void (*)(void))function, METH_FASTCALL, NULL}

static PyMethodDef station_methods[] = {FAST("_wake", station_wake), {NULL}};
static PyMethodDef timetable_methods[] = {
    FAST("enter", timetable_enter), FAST("take", timetable_take), {NULL}};
static PyMethodDef end_methods[] = {
    FAST("poll", end_poll), FAST("send", end_send), FAST("receive", end_receive), {NULL}};
static PyMethodDef arbiter_methods[] = {FAST("push", arbiter_push), {NULL}};
static PyMethodDef segment_methods[] = {
    {"_plan", segment_plan, METH_NOARGS, NULL},
    FAST("advance", segment_advance),
    FAST("advance_until_received", segment_advance_until_received),
    FAST("send", segment_send), {NULL}};
static PyMethodDef no_methods[] = {{NULL}};

FIELDS(Station, timetable, port, station_fields, station_methods)
FIELDS(Timetable, stations, ticks, timetable_fields, timetable_methods)
FIELDS(End, accepts, wire, end_fields, end_methods)
FIELDS(Arbiter, ends, slow, arbiter_fields, arbiter_methods)
FIELDS(Routes, table, unfiltered, routes_fields, no_methods)
FIELDS(Busy, spans, spans, busy_fields, no_methods)
FIELDS(Segment, arbiter, whole, segment_fields, segment_methods)

/* The rig: from tick to tick. */

static int
tick_station(Station *station, Timetable *table, us now_us, PyObject *number)
{
    us due_us;
    int result = -1;
    PyObject *received = NULL, *sent = NULL;
    PyObject *device = Py_XNewRef(station->device), *port = Py_XNewRef(station->port);
    if (device == NULL || port == NULL) {
        PyErr_SetString(PyExc_AttributeError, "a station without device and port");
        goto end;
    }
    int direct = IS(port, End);
    received = direct ? poll((End *)port, now_us, number)
                      : PyObject_CallMethodOneArg(port, s_poll, number);
    if (received == NULL)
        goto end;
    int work = PyTuple_CheckExact(received) ? PyTuple_GET_SIZE(received) > 0
                                            : PyObject_IsTrue(received);
    if (!work) {
        if (read_attribute(device, s_due_us, &due_us) < 0)
            goto end;
        work = due_us <= now_us;
    }
    if (work < 0)
        goto end;
    if (work) {
        PyObject *args[] = {device, number, received};
        sent = PyObject_VectorcallMethod(s_tick, args, 3, NULL);
        int some = sent == NULL ? -1 : PyObject_IsTrue(sent);
        if (some < 0)
            goto end;
        if (some) {
            int gone;
            if (direct && PyTuple_CheckExact(sent) && IS(((End *)port)->segment, Segment)) {
                PyObject *segment = Py_NewRef(((End *)port)->segment);
                gone = send_frames((Segment *)segment, (End *)port, now_us, sent);
                Py_DECREF(segment);
            } else {
                PyObject *all[] = {port, number, sent};
                gone = done(PyObject_VectorcallMethod(s_send, all, 3, NULL));
            }
            if (gone < 0)
                goto end;
        }
    }
    if (read_attribute(device, s_due_us, &due_us) < 0)
        goto end;
    result = due_us < NEVER ? enter(table, station, due_us) : 0;
end:
    Py_XDECREF(device);
    Py_XDECREF(port);
    Py_XDECREF(received);
    Py_XDECREF(sent);
    return result;
}

static int
tick_all(Timetable *table, us now_us, PyObject *number) /* the woken stations, as Rig._tick */
{
    PyObject *woken = table->first_us <= now_us ? take(table, now_us) : PyList_New(0);
    if (woken == NULL)
        return -1;
    table->open_us = now_us + 1;
    int result = 0;
    for (Py_ssize_t i = 0; result == 0 && i < PyList_GET_SIZE(woken); i++)
        result = tick_station((Station *)PyList_GET_ITEM(woken, i), table, now_us, number);
    Py_DECREF(woken);
    return result;
}

static int enter_due(PyObject *stations, Timetable *table);

static PyObject *
enter_stations(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    if (wrong_number("enter_stations", count, 2))
        return NULL;
    if (!is_table(args[0]) || !PyTuple_CheckExact(args[1])) {
        PyErr_SetString(PyExc_TypeError, "enter_stations() takes a Timetable and its stations");
        return NULL;
    }
    if (!enabled)
        Py_RETURN_FALSE;
    if (enter_due(args[1], (Timetable *)args[0]) < 0)
        return NULL;
    Py_RETURN_TRUE;
}

static PyObject *
tick_stations(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    us now_us;
    if (wrong_number("tick_stations", count, 2))
        return NULL;
    if (!is_table(args[0])) {
        PyErr_SetString(PyExc_TypeError, "tick_stations() takes a Timetable and a time");
        return NULL;
    }
    if (!enabled)
        Py_RETURN_FALSE;
    if (read_time(args[1], &now_us) < 0 || tick_all((Timetable *)args[0], now_us, args[1]) < 0)
        return NULL;
    Py_RETURN_TRUE;
}

static int
enter_due(PyObject *stations, Timetable *table) /* Rig._enter_due */
{
    for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(stations); i++) {
        Station *station = (Station *)PyTuple_GET_ITEM(stations, i);
        us due_us;
        if (!IS((PyObject *)station, Station) || station->device == NULL) {
            PyErr_SetString(PyExc_TypeError, "a station is none");
            return -1;
        }
        if (read_attribute(station->device, s_due_us, &due_us) < 0 ||
            (due_us < station->at_us && enter(table, station, due_us) < 0))
            return -1;
    }
    return 0;
}

static int
watch(PyObject *watchers, PyObject *number) /* Rig._watch */
{
    PyObject *all = PyList_AsTuple(watchers);
    int result = all == NULL ? -1 : 0;
    for (Py_ssize_t i = 0; result == 0 && i < PyTuple_GET_SIZE(all); i++)
        result = done(PyObject_CallOneArg(PyTuple_GET_ITEM(all, i), number));
    Py_XDECREF(all);
    return result;
}

static int
make_tick(PyObject *rig, PyObject *const *part, us now_us) /* Rig._happen and Rig._run */
{
    Timetable *table = (Timetable *)part[0];
    Segment *segment = (Segment *)part[1];
    PyObject *horizon = part[3], *watchers = part[4];
    PyObject *number = PyLong_FromLongLong(now_us);
    us outer = table->in_step;
    int result = number == NULL || PyObject_SetAttr(rig, s_now_us, number) < 0 ? -1 : 0;
    table->in_step = 1, table->open_us = now_us;
    if (result == 0)
        result = advance(segment, now_us);
    if (result == 0)
        result = tick_all(table, now_us, number);
    if (result == 0)
        result = PyObject_SetAttr(horizon, s_passed_us, number);
    if (result == 0 && PyList_GET_SIZE(watchers)) {
        result = advance(segment, now_us);
        if (result == 0)
            result = watch(watchers, number);
        if (result == 0)
            result = enter_due(part[6], table);
    }
    table->in_step = outer;
    Py_XDECREF(number);
    return result;
}

static int
read_now(PyObject *rig, PyObject *const *part, us *now_us) /* after a step at `now_us` */
{
    if (((Timetable *)part[0])->open_us == *now_us + 1) /* no callback has moved the time: 4 % */
        return 0;
    return read_attribute(rig, s_now_us, now_us);
}

static int
make_step_for(End *host, PyObject *rig, PyObject *const *part, us now_us) /* 1: it has received */
{
    if (make_tick(rig, part, now_us) < 0)
        return -1;
    if (host == NULL || host->arrived_us > now_us)
        return 0;
    return read_now(rig, part, &now_us) < 0 || advance((Segment *)part[1], now_us) < 0 ? -1 : 1;
}

/* Rig.run_to: of a rig and its parts, a time, the time up to which nobody looks, and a host or None.
   True if that time has come, or traffic for the host; False if Python has something to do before,
   or all of it. (A host that waits in one call: an SDO takes two thirds of the time.) */
static PyObject *
run(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    us until_us, unseen_us, now_us, due_us;
    PyObject *part[7] = {NULL};
    if (wrong_number("run", count, 5))
        return NULL;
    int whole = PyTuple_CheckExact(args[1]) && PyTuple_GET_SIZE(args[1]) == 7;
    for (int i = 0; whole && i < 7; i++)
        part[i] = PyTuple_GET_ITEM(args[1], i); /* the tuple is held by the caller */
    PyObject *rig = args[0], *queue = part[2], *horizon = part[3], *watchers = part[4],
             *hosts = part[5];
    if (!whole || !is_table(part[0]) || !IS(part[1], Segment) || !PyList_Check(watchers) ||
        !PyList_Check(hosts) || !PyTuple_CheckExact(part[6])) {
        PyErr_SetString(PyExc_TypeError, "run() takes a rig, its parts and two times");
        return NULL;
    }
    Timetable *table = (Timetable *)part[0];
    Segment *segment = (Segment *)part[1];
    if (read_time(args[2], &until_us) < 0 || read_time(args[3], &unseen_us) < 0)
        return NULL;
    End *host = args[4] == Py_None ? NULL : (End *)args[4];
    if (!enabled || segment->whole != Py_True || PyList_GET_SIZE(hosts) || until_us > FAR ||
        (host != NULL && (!IS(args[4], End) || host->segment != part[1])))
        Py_RETURN_FALSE;
    if (read_attribute(rig, s_now_us, &now_us) < 0 || enter_due(part[6], table) < 0 ||
        read_attribute(queue, s_due_us, &due_us) < 0)
        return NULL;
    if (PyList_GET_SIZE(watchers))
        unseen_us = 0;
    else if (unseen_us > due_us - 1)
        unseen_us = due_us - 1;
    if (write_attribute(horizon, s_until_us, unseen_us) < 0)
        return NULL;
    while (enabled && segment->whole == Py_True && !PyList_GET_SIZE(hosts)) {
        us tick_us = table->first_us > now_us ? table->first_us : now_us;
        us next_us = tick_us < due_us ? tick_us : due_us;
        int woken = 0, arrived = host != NULL && host->arrived_us < next_us;
        if (arrived)
            next_us = host->arrived_us > now_us ? host->arrived_us : now_us;
        else
            woken = advance_until(segment, next_us - 1 < until_us ? next_us - 1 : until_us);
        if (woken < 0)
            return NULL;
        if (!woken && next_us > until_us) { /* Rig._pass_to */
            if (advance(segment, until_us) < 0)
                return NULL;
            if (until_us > now_us) {
                if (write_attribute(rig, s_now_us, until_us) < 0 ||
                    write_attribute(horizon, s_passed_us, until_us) < 0)
                    return NULL;
                now_us = until_us;
            }
            table->open_us = now_us + 1;
            Py_RETURN_TRUE;
        }
        if (!woken) {
            if (due_us <= next_us)
                break; /* an action of the event queue */
            int received = make_step_for(host, rig, part, next_us);
            if (received < 0)
                return NULL;
            if (received)
                Py_RETURN_TRUE;
            now_us = next_us;
            if (read_now(rig, part, &now_us) < 0)
                return NULL;
        } else if (!PyList_GET_SIZE(segment->observers)) {
            continue; /* nobody could have entered an action */
        }
        if (read_attribute(queue, s_due_us, &due_us) < 0)
            return NULL;
    }
    Py_RETURN_FALSE;
}

static const char *const method_names[METHODS] = {
    "Station._wake", "Timetable.enter", "Timetable.take", "CanEnd.poll", "CanEnd.send",
    "CanEnd.receive", "CanArbiter.push", "CanSegment._plan",
    "TransmissionOutcomes._deliver", "CanSegment.advance", "CanSegment.advance_until_received",
    "CanSegment.send", "_ignore"};

static PyObject *
method(PyObject *module, PyObject *args) /* takes a Python method; returns what replaces it */
{
    const char *name;
    PyObject *function;
    if (!PyArg_ParseTuple(args, "sO", &name, &function))
        return NULL;
    PyTypeObject *types[] = {StationType, TimetableType, EndType, ArbiterType, SegmentType};
    const char *of[] = {"Station.", "Timetable.", "CanEnd.", "CanArbiter.", "CanSegment."};
    for (int i = 0; i < METHODS; i++)
        if (!strcmp(name, method_names[i])) {
            put(&reference[i], function);
            for (int t = 0; t < 5; t++)
                if (!strncmp(name, of[t], strlen(of[t]))) {
                    PyObject *key = PyUnicode_FromString(name + strlen(of[t]));
                    PyObject *mine = key == NULL
                        ? NULL : PyDict_GetItemWithError(types[t]->tp_dict, key);
                    Py_XDECREF(key);
                    if (mine != NULL || PyErr_Occurred())
                        return Py_XNewRef(mine);
                }
            return Py_NewRef(function);
        }
    return PyErr_Format(PyExc_KeyError, "the kernel has no method %s", name);
}

static PyObject *
enable(PyObject *module, PyObject *wanted)
{
    int before = enabled, now = PyObject_IsTrue(wanted);
    if (now < 0)
        return NULL;
    enabled = now;
    return PyBool_FromLong(before);
}

static PyObject *
bits_of(PyObject *module, PyObject *item)
{
    Frame frame;
    if (!read_frame(item, &frame))
        Py_RETURN_NONE;
    return PyLong_FromLong(frame_bits(&frame));
}

static PyMethodDef functions[] = {
    FAST("run", run), FAST("tick_stations", tick_stations), FAST("enter_stations", enter_stations), {"method", method, METH_VARARGS, NULL},
    {"enable", enable, METH_O, NULL}, {"frame_bits", bits_of, METH_O, NULL}, {NULL}};

static struct PyModuleDef kernel = {PyModuleDef_HEAD_INIT, "_kernel", NULL, -1, functions};

static PyTypeObject *
made(PyObject *module, PyType_Spec *spec, PyMemberDef *fields)
{
    PyObject *type = PyType_FromSpec(spec), *slots = PyList_New(0), *all = NULL;
    int result = type == NULL || slots == NULL ? -1 : 0;
    for (; result == 0 && fields->name != NULL; fields++) {
        PyObject *name = PyUnicode_FromString(fields->name);
        result = name == NULL ? -1 : PyList_Append(slots, name);
        Py_XDECREF(name);
    }
    if (result == 0 && (all = PyList_AsTuple(slots)) != NULL && /* copyreg and snapshots ask it */
        PyObject_SetAttrString(type, "__slots__", all) == 0 &&
        PyModule_AddObjectRef(module, strrchr(spec->name, '.') + 1, type) == 0)
        result = 1;
    Py_XDECREF(slots);
    Py_XDECREF(all);
    if (result != 1)
        Py_CLEAR(type);
    return (PyTypeObject *)type;
}

#define INTERN(name) || (s_##name = PyUnicode_InternFromString(#name)) == NULL

PyMODINIT_FUNC
PyInit__kernel(void)
{
    PyObject *module = PyModule_Create(&kernel);
    if (module == NULL)
        return NULL;
    fill_tables();
    PyObject *collections = PyImport_ImportModule("collections");
    deque = collections == NULL ? NULL : PyObject_GetAttrString(collections, "deque");
    Py_XDECREF(collections);
    if (deque == NULL || (empty_tuple = PyTuple_New(0)) == NULL EACH_NAME(INTERN) ||
        (StationType = made(module, &Station_spec, station_fields)) == NULL ||
        (TimetableType = made(module, &Timetable_spec, timetable_fields)) == NULL ||
        (EndType = made(module, &End_spec, end_fields)) == NULL ||
        (ArbiterType = made(module, &Arbiter_spec, arbiter_fields)) == NULL ||
        (RoutesType = made(module, &Routes_spec, routes_fields)) == NULL ||
        (BusyType = made(module, &Busy_spec, busy_fields)) == NULL ||
        (SegmentType = made(module, &Segment_spec, segment_fields)) == NULL) {
        Py_DECREF(module);
        return NULL;
    }
    return module;
}
